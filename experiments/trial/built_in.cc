// turbidock's own controllers and estimators: one line each. The first of each kind is the default.

#include "control/lqg.h"
#include "control/p_voltage.h"
#include "control/pid.h"
#include "experiments/trial/plugin_of.h"
#include "experiments/trial/recorded.h"
#include "experiments/trial/scene_marker.h"
#include "vision/blob_estimator.h"
#include "vision/fiducial_estimator.h"
#include "vision/rm_ga.h"

namespace turbidock::trial {

Plugins::Plugins() {
  AddController<control::PVoltage>("p_voltage", "published proportional controller");
  AddController<control::Pid>("pid", "proportional, integral and derivative control");
  AddController<control::Lqg>("lqg", "linear-quadratic control with a Kalman filter");
  AddController<control::PlaybackParams>(
      "playback", {}, &PlaybackSpec, "commands from a file, open loop, in a controller's place");

  AddEstimator<vision::RmGaOptions>("rm_ga", {},
                                    [](const auto& options, const EstimatorSetup& of) {
                                      return std::make_unique<vision::RmGa>(options, of.marker,
                                                                            of.hue, of.rig, of.rng);
                                    },
                                    {.doc = "estimator rm_ga: a genetic search for the pose"});
  AddEstimator<vision::BlobParams>("blobs", {},
                                   [](const auto& params, const EstimatorSetup& of) {
                                     return std::make_unique<vision::BlobEstimator>(
                                         params, of.marker, of.hue, of.rig);
                                   },
                                   {.has_keys = false});
  AddEstimator<vision::FiducialParams>(
      "fiducial", {},
      [](const auto& params, const EstimatorSetup& of) {
        return std::make_unique<vision::FiducialEstimator>(params, of.rig);
      },
      {.doc = "estimator that reads fiducial tags, and the tags as it knows them",
       .scene = {&TakesTags, &TakeTags, &CheckTags, "estimator.fiducial.tags_from_scene",
                 "estimator.fiducial.tags"}});
  built_in_ = false;
}

}  // namespace turbidock::trial
