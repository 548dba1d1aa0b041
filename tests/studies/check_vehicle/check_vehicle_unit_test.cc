// What a builder is told, of vehicles with one thing wrong.

#include "experiments/studies/check_vehicle/check_vehicle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "experiments/config/data_files.h"
#include "experiments/system/output_path.h"
#include "tests/support/own_folder.h"
#include "tests/support/program.h"

namespace turbidock::check_vehicle {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

VehicleCheck Check(const std::vector<std::string>& assignments) {
  return CheckVehicle(trial::LoadScenario("sea_night_active", assignments));
}
std::string Refusal(const std::vector<std::string>& assignments) {
  try {
    Check(assignments);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CheckVehicle, ThePublishedVehicleIsAsItsDataSay) {
  const VehicleCheck check = Check({});
  EXPECT_THAT(check.problems, IsEmpty());
  // The waves of a calm sea take nearly all of the one sway thruster.
  EXPECT_THAT(check.warnings,
              ElementsAre(HasSubstr("asks for up to 4.0 of the 4.4 N that there are on sway")));
  EXPECT_NEAR(check.floating.buoyancy_newton, 9.81 * (1025 * 0.014654 - 15), 1e-9);
  EXPECT_NEAR(check.floating.righting_newton_m, 9.81 * 1025 * 0.014654 * 0.03, 1e-9);
  EXPECT_NEAR(check.axes[0].most, 9.8, 1e-12);
  ASSERT_EQ(check.thrusters.size(), 4u);
  EXPECT_EQ(check.thrusters[0].drives, "surge +, yaw -");
  EXPECT_EQ(check.thrusters[3].drives, "heave +");
  // Closed form without inflow: 12 v + 55 v^2 = 9.8 N.
  const VehicleCheck free = Check({"vehicle.thrusters.inflow_loss_s_per_m=0"});
  EXPECT_NEAR(free.axes[0].speed, (-12 + std::sqrt(144 + 4 * 55 * 9.8)) / (2 * 55), 1e-9);
  EXPECT_NEAR(check.pole.past_throat_m, 0.04, 1e-9);
  EXPECT_NEAR(check.pole.clearance_m, 0.0175, 1e-9);
}

// The thrusters are drawn where they are on the hull.
TEST(CheckVehicle, ShowsTheHullBehindTheThrusters) {
  const VehicleCheck check = Check({});
  const report::Report report = ReportOf(check);
  const auto section = std::ranges::find(report.sections, "Thrusters", &report::Section::title);
  ASSERT_NE(section, report.sections.end());
  ASSERT_EQ(check.hull.size(), 2u);
  for (const report::Panel& panel : section->panels) {
    double low = 0, high = 0;
    for (size_t i = 0; i < check.hull.size(); ++i) {
      const std::vector<report::Sample>& outline = panel.series[i].points;
      ASSERT_GE(outline.size(), 4u);  // ends where it begins
      EXPECT_EQ(outline.front().x, outline.back().x);
      EXPECT_EQ(outline.front().y, outline.back().y);
      double most = -INFINITY;
      for (size_t k = 0; k < outline.size(); ++k) {
        const report::Sample &a = outline[k], &b = outline[(k + 1) % outline.size()],
                             &c = outline[(k + 2) % outline.size()];
        const double turn = (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
        EXPECT_GE(turn, -1e-12);  // convex: only to the left
        low = std::min(low, a.x);
        most = std::max(most, a.x);
      }
      high = std::max(high, most);
      EXPECT_DOUBLE_EQ(most, check.hull[i].high_m.x());
    }
    for (const ThrusterReport& thruster : check.thrusters) {
      EXPECT_GE(thruster.p_BT_m.x(), low) << panel.title;
      EXPECT_LE(thruster.p_BT_m.x(), high) << panel.title;
    }
  }
}

TEST(CheckVehicle, SaysInWordsWhatIsWrong) {
  EXPECT_THAT(Check({"vehicle.hydrodynamics.p_BBcb_m=[0, 0, -0.03]"}).problems,
              Contains(HasSubstr("does not stay upright")));
  EXPECT_THAT(Check({"vehicle.hydrodynamics.p_BBcb_m=[0.01, 0, 0.03]"}).warnings,
              Contains(HasSubstr("floats askew: rolled by 0.0° and pitched by -18.4°")));
  EXPECT_THAT(Check({"vehicle.rigid_body.mass_kg=15.2"}).warnings,
              Contains(HasSubstr("it sinks with 1.8 N")));
  EXPECT_THAT(
      Check({"vehicle.hydrodynamics.linear_damping_diagonal=[12, 7, 13, 0, 0.15, 0.8]"}).warnings,
      Contains(HasSubstr("nothing damps small swings in roll")));
  EXPECT_THAT(Check({"sea.current.surface_velocity_mps=[0, 0.4, 0]"}).problems,
              Contains(HasSubstr("cannot hold its place")));
  EXPECT_THAT(Check({"procedure.docked_x_m=0.45"}).problems,
              Contains(HasSubstr("60 mm short of the straight hole")));
  EXPECT_THAT(Check({"cameras.rig.horizontal_fov_rad=0.5"}).problems,
              Contains(HasSubstr("is not whole in it")));
  const std::string of_eight = "vehicle.thrusters.effectiveness=[1, 1, 1, 1, 1, 1, 1, 0]";
  EXPECT_THAT(CheckVehicle(trial::LoadScenario("bluerov2_sea_night", {of_eight})).warnings,
              Contains(HasSubstr("has no force in either direction")));
}

TEST(CheckVehicle, RefusesWhatIsNoVehicle) {
  EXPECT_THAT(Refusal({"vehicle.rigid_body.mass_kg=30"}),
              HasSubstr("30 kg displace 0.014654 m^3: the vehicle sinks with 147.0 N and its "
                        "thrusters have 4.9 N against that"));
  EXPECT_THAT(Refusal({"vehicle.thrusters.effectiveness=[1, 1]"}),
              HasSubstr("effectiveness: has 2 values, but there are 4 thrusters"));
  EXPECT_THAT(Refusal({"vehicle.model=none.xml"}),
              HasSubstr("vehicle.model = 'none.xml', is neither a file nor one of the bundled"));
}

// The published vehicle's files under another name, in a folder of their own.
class CheckVehicleCommand : public testing::OwnFolder {
 protected:
  std::string Vehicle(const std::string& name) const {
    for (const char* kind : {".xml", ".yaml"})
      std::filesystem::copy_file(config::ModelPath(std::string("vehicle") + kind),
                                 folder_ / (name + kind));
    return (folder_ / (name + ".xml")).string();
  }
  static testing::ProgramEnd Run(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {"check-vehicle"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return testing::RunProgram(all);
  }
};

TEST_F(CheckVehicleCommand, AFileMayHaveAnyName) {
  for (const char* name : {"a #2", "a: b", "[x]", "\"q\"", "'", "!!int 3", "~"}) {
    const std::string file = Vehicle(name);
    const testing::ProgramEnd end = Run({file});
    EXPECT_EQ(end.exit_code, 0) << end.err;
    EXPECT_THAT(end.out, HasSubstr(std::string(": ") + name + ".xml in night sea"));
  }
}

// Nothing is called ready to dock that no trial would fly.
TEST_F(CheckVehicleCommand, RefusesWhatCannotBeSimulated) {
  const std::string file = Vehicle("weak");
  std::string text = system::ReadWhole(file);
  const size_t motor = text.find("<motor ");
  ASSERT_NE(motor, std::string::npos);
  text.insert(motor + 7, "ctrllimited=\"true\" ctrlrange=\"-0.1 0.1\" ");
  std::ofstream(file) << text;
  const testing::ProgramEnd end = Run({file});
  EXPECT_EQ(end.exit_code, 2) << end.err;
  EXPECT_THAT(end.err, HasSubstr("with a gear of length 1 and no limits"));
}

// What no figure of it tells: it is flown.
TEST_F(CheckVehicleCommand, CallsReadyOnlyWhatDocks) {
  const std::string file = Vehicle("own");
  const testing::ProgramEnd sound = Run({file});
  EXPECT_EQ(sound.exit_code, 0);
  EXPECT_THAT(sound.out, ContainsRegex("docked +4 of 4 "));
  const testing::ProgramEnd dead =
      Run({file, "--set", "vehicle.thrusters.effectiveness=[1, 1, 0, 1]"});
  EXPECT_EQ(dead.exit_code, 1);
  EXPECT_THAT(dead.out, HasSubstr("nothing pushes it along sway by itself"));
  EXPECT_THAT(dead.out, ContainsRegex("sway +0.0 N +0.0 N +0.00 m/s"));
  // The same by a fault: the axis has its thruster, and half of the trials end elsewhere.
  const testing::ProgramEnd broken =
      Run({file, "--set", "faults.thrusters=[{thruster: sway, force_factor: 0}]"});
  EXPECT_EQ(broken.exit_code, 1);
  EXPECT_THAT(broken.out, ContainsRegex("of 4 trials on the true pose [012] dock"));
  const testing::ProgramEnd half =
      Run({file, "--set", "vehicle.thrusters.effectiveness=[1, 1, 0.5, 1]", "--set",
           "sea.current.surface_velocity_mps=[0, 0, 0]"});
  EXPECT_THAT(half.out, ContainsRegex("sway +2.5 N +-2.2 N"));
  const testing::ProgramEnd askew =
      Run({file, "--set", "vehicle.hydrodynamics.p_BBcb_m=[0.08, 0, 0.01]"});
  EXPECT_EQ(askew.exit_code, 1);
  EXPECT_THAT(askew.out, HasSubstr("of 4 trials on the true pose 0 dock, the first that does not"));
}

TEST_F(CheckVehicleCommand, TellsWhatTheMjcfHasElsewhere) {
  const std::string file = Vehicle("own"), text = system::ReadWhole(file);
  const auto said = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    std::ofstream(file) << other;
    return Run({file}).out;
  };
  EXPECT_THAT(said("\n", "\n"), AllOf(Not(HasSubstr("cameras.rig")), Not(HasSubstr("pole_tip"))));
  EXPECT_THAT(said("\"left\" pos=\"0.19 0.06 0.06\"", "\"left\" pos=\"0.19 0.05 0.06\""),
              HasSubstr("has the left camera at (0.190, 0.050, 0.060) m, cameras.rig puts it at "
                        "(0.190, 0.060, 0.060) m, which counts"));
  EXPECT_THAT(said("0.4825 0 -0.11", "0.42 0 -0.11"),
              HasSubstr("its pole ends 62 mm before pole_tip"));
}

TEST_F(CheckVehicleCommand, AVehicleIsTheFileThatIsNamed) {
  const std::string file = Vehicle("own"), data = (folder_ / "own.yaml").string();
  for (const char* set :
       {"vehicle.model=bluerov2_heavy.xml", "vehicle={model: bluerov2_heavy.xml}"})
    EXPECT_THAT(Run({file, "--set", set}).err, HasSubstr("the vehicle is the file that is named"));
  EXPECT_EQ(Run({data}).err,
            "turbidock: " + data + ": is no MJCF; give that, " + file + ", and this beside it\n");
}

TEST_F(CheckVehicleCommand, WritesNoUrdfOverAVehicle) {
  const std::string urdf = TURBIDOCK_TEST_DATA "/../../assets/urdf/six_thrusters.urdf";
  const std::string out = (folder_ / "rov.xml").string(), data = (folder_ / "rov.yaml").string();
  std::ofstream(data) << "rigid_body: {mass_kg: 7}\n";
  EXPECT_THAT(Run({urdf, "--mjcf", out}).err, HasSubstr("rov.yaml: is kept, and counts where it"));
  EXPECT_EQ(system::ReadWhole(data), "rigid_body: {mass_kg: 7}\n");
  std::ofstream(out, std::ios::app) << "<!-- mine -->\n";
  const std::string mine = system::ReadWhole(out);
  const testing::ProgramEnd again = Run({urdf, "--mjcf", out});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("is there already: remove it to write it anew"));
  EXPECT_EQ(system::ReadWhole(out), mine);
}

TEST_F(CheckVehicleCommand, WarnsOfAPoleThatTouchesNothing) {
  const std::string file = Vehicle("ghost");
  EXPECT_THAT(Run({file}).out, Not(HasSubstr("nothing stops its pole")));
  std::string text = system::ReadWhole(file);
  const size_t pole = text.find("name=\"pole\"");
  ASSERT_NE(pole, std::string::npos);
  text.insert(pole, "contype=\"0\" conaffinity=\"0\" ");
  std::ofstream(file) << text;
  const testing::ProgramEnd end = Run({file});
  EXPECT_EQ(end.exit_code, 0) << end.err;
  EXPECT_THAT(end.out, ContainsRegex("Warnings\n(.*\n)?nothing stops its pole at the dock"));
}

TEST_F(CheckVehicleCommand, WritesNothingOverTheVehicle) {
  const std::string file = Vehicle("own"), data = (folder_ / "own.yaml").string();
  for (const std::string& read : {file, data}) {
    const testing::ProgramEnd end = Run({file, "--mjcf", read});
    EXPECT_EQ(end.exit_code, 2);
    EXPECT_EQ(end.err, "turbidock: " + read +
                           ": is read by this command; give another file to "
                           "write\n");
  }
}

TEST_F(CheckVehicleCommand, RunSaysWhatMakesAVehicleOfAUrdf) {
  const std::string file = (folder_ / "rov.urdf").string();
  std::ofstream(file) << "<robot/>";
  const testing::ProgramEnd end =
      testing::RunProgram({"run", "pool_active", "--set", "vehicle.model=" + file});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("is a URDF; `turbidock check-vehicle FILE --mjcf NAME.xml`"));
}

TEST_F(CheckVehicleCommand, SaysThatMjcfNeedsNoConversion) {
  const std::string file = Vehicle("own"), out = (folder_ / "new.xml").string();
  const testing::ProgramEnd end = Run({file, "--mjcf", out});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_EQ(end.out, "");
  EXPECT_EQ(end.err, "turbidock: --mjcf " + out + ": " + file +
                         " is no URDF: there is nothing to convert\n");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(CheckVehicle, TheListOfNamesIsTheReadmes) {
  std::ifstream file(config::ModelPath("names.md"));
  std::ostringstream text;
  text << file.rdbuf();
  report::Table names({"<part", "<kind", "<name", "<what it is"});
  for (const vehicle::ModelName& name : vehicle::ModelNames())
    names.Row({name.of, name.kind, "`" + std::string(name.name) + "`", name.meaning});
  EXPECT_THAT(text.str(), HasSubstr(names.Markdown()));
}

}  // namespace
}  // namespace turbidock::check_vehicle
