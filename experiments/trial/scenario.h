#pragma once
// A scenario: everything that decides a trial, besides the program itself. A YAML file is read over
// the defaults in these structs and models/vehicle.yaml; `resolved.yaml` of a trial holds every
// value and runs to the same digest.
//
// Whoever sets a key of it, a file, --set, a plan, a gate, a study or Python, does so by Resolve.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "control/approach.h"
#include "control/autopilot.h"
#include "control/docking_procedure.h"
#include "control/levelling.h"
#include "experiments/config/given_keys.h"
#include "experiments/config/group_ref.h"
#include "experiments/trial/faults.h"
#include "experiments/trial/plugins.h"
#include "sim/base/camera.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"
#include "sim/base/pose.h"
#include "sim/camera/camera_params.h"
#include "sim/light/marine_snow.h"
#include "sim/light/optics_params.h"
#include "sim/vehicle/attitude_sensor.h"
#include "sim/vehicle/mooring.h"
#include "sim/vehicle/navigation_sensor.h"
#include "sim/vehicle/scene.h"
#include "sim/vehicle/sea.h"
#include "sim/vehicle/vehicle_params.h"
#include "sim/view/gl_context.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/rm_ga_options.h"

namespace turbidock::trial {

inline constexpr int kScenarioSchema = 1;

// Where the vehicle is when the trial begins: somewhere in front of the marker, drawn from the
// stream "start"; distances are of the camera head from the marker, in the marker's frame. Or where
// a log has it: position_m and what follows are of the vehicle's origin B, empty where not given.
struct StartParams {
  double distance_min_m = 0.9;
  double distance_max_m = 1.4;  // paper: the vehicle is brought to less than 1.5 m
  double lateral_m = 0.2;       // guess: what a pilot achieves
  double vertical_m = 0.1;
  double heading_rad = 0.14;  // 8 degrees
  double roll_rad = 0, pitch_rad = 0;
  std::vector<double> position_m{}, quaternion_wxyz{}, velocity_mps{}, turn_rate_rad_s{};

  static void Fields(auto& self, auto&& field) {
    field("distance_min_m", self.distance_min_m, InRange(0.2, 10),
          "least distance of the camera head from the marker at the start");
    field("distance_max_m", self.distance_max_m, InRange(0.2, 10),
          "largest distance of the camera head from the marker at the start");
    field("lateral_m", self.lateral_m, InRange(0, 5),
          "largest offset of the start to either side of the marker");
    field("vertical_m", self.vertical_m, InRange(0, 5),
          "largest offset of the start above or below the marker");
    field("heading_rad", self.heading_rad, InRange(0, 3.2),
          "largest heading error at the start, to either side");
    field("roll_rad", self.roll_rad, InRange(0, 1.5), "largest roll at the start, to either side");
    field("pitch_rad", self.pitch_rad, InRange(0, 1.5),
          "largest pitch at the start, to either side");
    field("position_m", self.position_m, InRange(-1000, 1000),
          "x, y, z of the vehicle's origin in the world's frame W at the start; given, no start is "
          "drawn");
    field("quaternion_wxyz", self.quaternion_wxyz, InRange(-1, 1),
          "attitude in the world's frame W at a given start position: unit quaternion w, x, y, z; "
          "level and ahead unless given");
    field("velocity_mps", self.velocity_mps, InRange(-10, 10),
          "velocity at the start, along the axes of the vehicle's frame B: ahead, left, up; 0 "
          "unless given");
    field("turn_rate_rad_s", self.turn_rate_rad_s, InRange(-10, 10),
          "turn rate at the start, about the axes of the vehicle's frame B: ahead, left, up; 0 "
          "unless given");
  }
  void Check(const std::string& path) const;

  bool placed() const { return !position_m.empty(); }
  Pose placed_X_WB() const;  // where it is placed
  Twist V_WB_B() const;
};

// What keys of water, lights, cameras and estimator.hue begin with.
enum class OpticsPreset {
  kPublished,      // assets/optics.yaml: the published rig, as its tables and pictures say
  kModernDigital,  // the keys' own defaults: a good digital camera of today, lamps and balls to
                   // suit
};
constexpr auto Names(OpticsPreset) {
  using enum OpticsPreset;
  return EnumList<OpticsPreset>({{kPublished, "published"}, {kModernDigital, "modern_digital"}});
}

enum class PoseSource {
  kCameras,   // images, estimator
  kTruePose,  // the true pose with noise and the same delay; nothing need be drawn
};
constexpr auto Names(PoseSource) {
  using enum PoseSource;
  return EnumList<PoseSource>({{kCameras, "cameras"}, {kTruePose, "true_pose"}});
}

// What is put on the true pose in place of an estimator's errors. The numbers are measured on the
// estimator: see assets/measured/estimator.md.
struct TruePoseParams {
  Eigen::Vector4d noise{0.0004, 0.0001, 0.0001, 0.0013};
  double correlation_s = 0;
  double fitness = 0.8;
  double found_after_s = 0.5;
  double nearest_m = 0, farthest_m = 100;

  static void Fields(auto& self, auto&& field) {
    field("noise", self.noise, InRange(0, 1),
          "true pose: standard deviation of the noise on x, y, z [m] and yaw [rad] at 0.6 m; that "
          "of x grows with the square of the distance, the others' in proportion");
    field("correlation_s", self.correlation_s, InRange(0, 10),
          "true pose: time in which the noise's correlation falls to 1/e; 0: independent in every "
          "frame");
    field("fitness", self.fitness, InRange(-1, 1),
          "true pose: fitness F reported of a ball in an image; out of it -0.2");
    field("found_after_s", self.found_after_s, InRange(0, 60),
          "true pose: time that the search takes once the marker is in sight");
    field("nearest_m", self.nearest_m, InRange(0, 10),
          "true pose: least distance x of the marker at which it is in sight");
    field("farthest_m", self.farthest_m, InRange(0, 100),
          "true pose: largest distance x of the marker at which it is in sight");
  }
};

// When the pole counts as jammed. Guesses: with the published servo, a pole that sticks to the rim
// of the mouth was seen to be held there by 1.3 to 1.9 N for seconds, within 1 mm.
struct JamParams {
  double force_newton = 1;
  double time_s = 1;
  double progress_m = 0.003;

  static void Fields(auto& self, auto&& field) {
    field("force_newton", self.force_newton, Above(0), "jam: least force that holds the pole");
    field("time_s", self.time_s, Above(0), "jam: least time for which the pole is held");
    field("progress_m", self.progress_m, Above(0),
          "jam: largest change of the pole's depth while it is held");
  }
};

// A file that a trial is made from: MJCF, what it includes, a mesh, a picture; recorded commands, a
// measured current.
struct ModelFile {
  std::string file;     // a bundled one's name, or a path
  std::string content;  // a digest

  static void Fields(auto& self, auto&& field) {
    field("file", self.file, Finite(), "name of a bundled model file, or a path");
    field("content", self.content, Finite(), "digest of a model file's content");
  }
};

struct Scenario {
  int schema_version = 0;
  std::string description;
  int64_t seed = 0;
  double duration_s = 0;
  // MJCF files, bundled ones or paths.
  InputFile model;
  InputFile vehicle_model = "vehicle.xml";
  InputFile station_model = "station.xml";
  std::vector<ModelFile> model_files;  // as they were when it was resolved; else empty
  int camera_period_frames = 1;
  int camera_delay_frames = 1;
  double camera_drop_probability = 0;
  bool region_of_interest = true;
  double after_docked_s = 1;
  OpticsPreset optics = OpticsPreset::kPublished;
  view::GlBackend renderer = view::GlBackend::kOsmesa;
  bool marker_from_scene = true;
  bool marker_may_differ = false;

  ClockParams clock;
  StartParams start;
  vehicle::SeaParams sea;
  vehicle::MooringParams mooring;
  light::OpticsParams light;  // keys water and lights
  RigParams rig;
  camera::SensorParams sensor;
  light::SnowParams snow;
  camera::LensParams lens;
  vision::MarkerParams marker;
  vision::HueParams hue;
  PoseSource pose_source = PoseSource::kCameras;
  TruePoseParams true_pose;
  control::ProcedureParams procedure;
  control::LevellingParams levelling;
  control::ApproachParams approach;
  vehicle::AttitudeSensorParams attitude_sensor;
  vehicle::NavigationParams navigation;
  vehicle::VehicleParams vehicle;
  vehicle::VehicleData known_vehicle;  // as the controller knows it
  JamParams jam;
  Faults faults;
  Plugins plugins;          // keys control.use, estimator.use and a group of each one's
  config::GivenKeys given;  // no keys of its own

  // Keys are in groups, whatever struct a member is in.
  static constexpr std::array<std::pair<const char*, const char*>, 14> kGroups = {
      {{"trial", "trial: scene, seed, end, clock and drawing"},
       {"start", "start of the vehicle: its place, attitude and speed"},
       {"vehicle", "vehicle: mass, forces of the water, thrusters and contact"},
       {"station", "station that the vehicle docks at, and its motion on a mooring"},
       {"sea", "sea: motion of the water by current and waves"},
       {"water", "water: its effect on light"},
       {"lights", "lights: lamps of the vehicle, light in the balls of the marker"},
       {"cameras", "cameras: their rig, lenses, electronics and times"},
       {"marker", "marker as the estimator knows it"},
       {"estimator", "estimator that finds the marker in the images, or what is in its place"},
       {"navigation", "navigation that tells the vehicle's position and attitude"},
       {"procedure", "procedure of docking, stage by stage"},
       {"control", "control: what steers the vehicle by the estimate"},
       {"faults", "faults: what goes wrong, and when"}}};

  static void Fields(auto& self, auto&& field) {
    field("schema_version", self.schema_version, InRange(kScenarioSchema, kScenarioSchema),
          "version of the scenario's keys");
    field("description", self.description, Finite(), "description in one line, for people");
    field("trial.scene", self.model, Finite(),
          "MJCF file of the scene: a bundled one, or a path from the scenario's folder");
    field("trial.seed", self.seed, AtLeast(0),
          "number from which all random streams of the trial are drawn");
    field("trial.duration_s", self.duration_s, InRange(0.001, 86400),
          "simulated time after which the trial ends");
    field("trial.after_docked_s", self.after_docked_s, InRange(0, 60),
          "time for which the vehicle holds the last pose once docked, before the trial ends");
    field("trial.jam", self.jam, Finite(), "jam: when the pole counts as jammed in the dock");
    field("trial.clock", self.clock, Finite(), "clock: frames and physics steps");
    field("trial.renderer", self.renderer, Range{},
          "library that draws the images; where this machine lacks it, the other is used");
    field("trial.region_of_interest", self.region_of_interest, Finite(),
          "whether only those pixels are made that the estimator can read, which does not change "
          "the result");
    field("trial.model_files", self.model_files, Finite(),
          "files that the resolved scenario was made from");
    field("start", self.start, Finite(), "");
    field("vehicle.model", self.vehicle_model, Finite(),
          "MJCF file to be taken for the scene's vehicle.xml, its data (NAME.yaml) beside it: a "
          "bundled one, or a path from the scenario's folder");
    field("vehicle", self.vehicle, Finite(), "");
    field("station.model", self.station_model, Finite(),
          "MJCF file to be taken for the scene's station.xml: a bundled one, or a path from the "
          "scenario's folder");
    field("station.mooring", self.mooring, Finite(), "mooring: motion of the station");
    field("sea", self.sea, Finite(), "");
    field("water", self.light.water, Finite(), "");
    field("water.snow", self.snow, Finite(), "marine snow: particles seen one by one");
    field("lights.lamps", self.light.lamps, Finite(), "lamps of the vehicle");
    field("lights.marker", self.light.ball_lights, Finite(), "light in the marker's balls");
    field("lights.shading", self.light.shading, Finite(), "accuracy with which light is computed");
    field("cameras.optics", self.optics, Range{},
          "sets keys of water, lights, cameras.sensor and estimator.hue: to the published rig's, "
          "or to those of a digital camera of today");
    field("cameras.rig", self.rig, Finite(), "stereo rig of two cameras");
    field("cameras.sensor", self.sensor, Finite(), "electronics of the cameras");
    field("cameras.lens", self.lens, Finite(),
          "lens distortion, radial, that the estimator does not know of");
    field("cameras.period_frames", self.camera_period_frames, InRange(1, 240),
          "number of frames from one exposure to the next; the command holds in between");
    field("cameras.delay_frames", self.camera_delay_frames, InRange(0, 30),
          "number of frames from exposure until the estimator has the image");
    field("cameras.drop_probability", self.camera_drop_probability, InRange(0, 0.99),
          "share of the images that never arrive at the estimator");
    field("marker.from_scene", self.marker_from_scene, Range{},
          "whether marker.balls and marker.box_m are the scene's; false: those of the bundled "
          "scenes; giving either says false");
    field("marker.may_differ", self.marker_may_differ, Range{},
          "whether to run although the marker as the estimator knows it is not the scene's");
    field("marker", self.marker, Finite(), "");
    field("estimator.hue", self.hue, Finite(), "hue matching: which pixels agree with a ball");
    field("estimator.pose_source", self.pose_source, Finite(),
          "source of the autopilot's pose: the cameras through the estimator, or the true pose "
          "with noise");
    field("estimator.true_pose", self.true_pose, Finite(),
          "noise on the true pose, for estimator.pose_source: true_pose");
    field("navigation", self.navigation, Finite(), "");
    field("navigation.attitude_sensor", self.attitude_sensor, Finite(), "sensor of roll and pitch");
    field("procedure", self.procedure, Finite(), "");
    field("procedure.approach", self.approach, Finite(), "approach to where the marker is found");
    field("control.levelling", self.levelling, Finite(),
          "levelling of roll and pitch, of a vehicle that can");
    field("control.known_vehicle", self.known_vehicle, Finite(),
          "vehicle as the controller knows it: the data of its file, whatever `vehicle` says");
    field("faults", self.faults, Finite(), "");
  }
  void MoreFields(config::GroupRef* group) { plugins.AddTo(group); }
  // Keys that stand for others set them where they are given; what is given later counts.
  static constexpr std::array kPresets = {"vehicle.model", "cameras.optics", "marker.from_scene",
                                          "procedure.approach.mode"};
  void Given(const std::string& key);
  void TakeDefaultBalls();  // as the bundled scenes have them
  void Check(const std::string& path) const;
  void CheckApproach(const std::string& path) const;

  // The chosen controller and estimator.
  const std::string& controller_name() const { return plugins.controller(); }
  const std::string& estimator_name() const { return plugins.estimator(); }
  control::ControlParams ControlInUse() const { return {plugins.Spec(), levelling}; }
  // Whether its commands come from a file.
  bool plays_back() const { return plugins.Spec().commands != nullptr; }
  // An estimator by its name, with the scenario's parameters.
  std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name, Rng rng) const;

  // What is between the scene and the images.
  camera::CameraParams cameras() const {
    return {.optics = light, .snow = snow, .lens = lens, .sensor = sensor};
  }

  // The clock of the images that arrive: what the vehicle's own computer lives by.
  ClockParams image_clock() const {
    return {.frames_per_second = clock.frames_per_second / camera_period_frames,
            .ticks_per_frame = clock.ticks_per_frame * camera_period_frames};
  }
  ImageTimes image_times() const {
    return {.period_s = image_clock().frame_s(),
            .delay_images = camera_delay_frames,
            .delay_s = clock.TimeOfFrame(camera_delay_frames)};
  }
};

// Sets values in a scenario, one after the other, and checks it: the one way in which anything is
// set in one. Of values for the same key the last one counts, and a key that stands for others (see
// Given) sets them. ConfigError for whatever is wrong; the scenario is then as it was.
void Resolve(const std::vector<config::Assignment>& given, Scenario* scenario);

// Reads a scenario: struct defaults, the vehicle's data (models/vehicle.yaml), assets/gains.yaml
// and optics.yaml, the file, the gains file if there is one, the assignments
// ("water.milk_ml_m3=20"). `name` is a file or a bundled scenario's name. ConfigError for whatever
// is wrong in them. A gains file holds any keys of a scenario but commonly those of the controller.
// `plugins` are what else `control.use` and `estimator.use` may name; they stay with the scenario.
// The marker's balls, where nothing gives them, are those of the scene; so is what else
// the chosen estimator knows of it.
Scenario LoadScenario(const std::string& name, const std::vector<std::string>& assignments,
                      const std::string& gains_file = "", const Plugins& plugins = {});
Scenario LoadScenario(const std::string& name, const std::vector<config::Assignment>& given,
                      const Plugins& plugins);

// Whether "key=value" gives this key, also within its group.
bool Gives(const std::string& assignment, const std::string& key);

// What a command line gives: a gains file, if there is one, then assignments.
std::vector<config::Assignment> GivenBy(const std::string& gains_file,
                                        const std::vector<std::string>& assignments);

// What a scenario's file is read over, with the presets that this one has.
Scenario PresetsOf(const Scenario& scenario);

// Every value as YAML, with its description as a comment. Parsing it gives the same scenario, bit
// for bit; `name` stands for the file in messages.
std::string SaveScenario(const Scenario& scenario);
Scenario ParseScenario(const std::string& text, const std::string& name,
                       const Plugins& plugins = {});

// The table of all keys, with the values of a scenario that gives none.
std::vector<config::KeyDoc> ScenarioKeys(const Plugins& plugins = {});

// The scenario's MJCF files. What a scene includes and does not have beside it is the bundled one.
// ConfigError for a scene without a vehicle.xml (station.xml) that another could be taken for.
vehicle::SceneFiles SceneFilesOf(const Scenario& scenario);

// What it is made from now: its models with all that they include, the vehicle's data, and every
// file that a key names. ConfigError as of vehicle::ContentsOf.
std::vector<ModelFile> ModelFilesOf(const Scenario& scenario);
// What is kept of a trial's scenario, resolved.yaml: SaveScenario with what it was made from.
std::string SaveResolved(Scenario scenario, const std::vector<ModelFile>& model_files);
// A sentence that names those of `now` that its `model_files` have otherwise; empty where there are
// none.
std::string ChangedModels(const Scenario& scenario, const std::vector<ModelFile>& now);

}  // namespace turbidock::trial

// Its many fields are compiled once, in scenario.cc.
extern template void turbidock::CheckFields(const turbidock::trial::Scenario& object,
                                            const std::string& path);
extern template turbidock::config::GroupRef turbidock::config::GroupOf(
    turbidock::trial::Scenario* object);
