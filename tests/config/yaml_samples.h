#pragma once
// Structs with every kind of field, and what is said of text that does not fit them.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "tests/support/message_of.h"

namespace turbidock::config {

enum class Lamp { kOff, kPassive, kActive };

constexpr auto Names(Lamp) {
  using enum Lamp;
  return EnumList<Lamp>({{kOff, "off"}, {kPassive, "passive"}, {kActive, "active"}});
}

struct Water {
  double milk_ml_m3 = 10;
  double scatter_scale = 1;

  static void Fields(auto& self, auto&& field) {
    field("milk_ml_m3", self.milk_ml_m3, AtLeast(0), "milk in the water");
    field("scatter_scale", self.scatter_scale, Above(0), "");
  }
};

struct Ball {
  std::string name = "ball";
  double radius_m = 0.02;
  Eigen::Vector3d p_m = {0, 0, 0.07};
  Water inside{};

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "colour");
    field("radius_m", self.radius_m, InRange(0.001, 1), "radius");
    field("p_m", self.p_m, Finite(), "centre in the marker");
    field("inside", self.inside, Finite(), "what it is filled with");
  }
};

struct Nothing {
  static void Fields(auto&, auto&&) {}
};

struct OneOfEverything {
  bool enabled = true;
  int count = 3;
  int64_t seed = 1;
  double baseline_m = 0.12;
  double gain = 1;
  std::string title = "first";
  Lamp lamp = Lamp::kActive;
  Eigen::Vector3d axis = {1, 0, 0};
  Eigen::Matrix<double, 6, 1> drag_newton_s_per_m = Eigen::Matrix<double, 6, 1>::Ones();
  Eigen::Matrix<double, 2, 3> gains;
  std::array<double, 2> limits_v{0.5, 1.5};
  std::vector<double> distances_m{0.4, 0.6};
  Water water;
  std::vector<Ball> balls{{.name = "red"}, {.name = "green"}};
  Nothing nothing;

  OneOfEverything() { gains << 1, 2, 3, 4, 5, 6; }

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(), "whether it runs");
    field("count", self.count, InRange(1, 100), "how many");
    field("seed", self.seed, AtLeast(0), "the seed");
    field("baseline_m", self.baseline_m, InRange(0.01, 1), "distance of the cameras");
    field("gain", self.gain, Finite(), "no unit");
    field("title", self.title, Finite(), "any text");
    field("lamp", self.lamp, Finite(), "which marker");
    field("axis", self.axis, InRange(-1, 1), "a direction");
    field("drag_newton_s_per_m", self.drag_newton_s_per_m, AtLeast(0), "by axis");
    field("gains", self.gains, Finite(), "two rows");
    field("limits_v", self.limits_v, InRange(0, 2.5), "a pair");
    field("distances_m", self.distances_m, Above(0), "any number of them");
    field("water", self.water, Finite(), "the medium");
    field("balls", self.balls, Finite(), "of the marker");
    field("nothing", self.nothing, Finite(), "");
  }

  void Check(const std::string& path) const {
    if (gain > 100 * baseline_m)
      throw ConfigError(JoinKey(path, "gain"), "too large for the baseline");
    if (water.milk_ml_m3 > 500 && water.scatter_scale > 2)
      throw ConfigError("water", "too turbid to compute");
  }
};

// The whole state, to the last bit.
inline std::vector<std::string> Bits(const OneOfEverything& o) {
  std::vector<std::string> all;
  auto number = [&](double x) {
    uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    all.push_back(std::to_string(bits));
  };
  all.push_back(o.enabled ? "t" : "f");
  all.push_back(std::to_string(o.count));
  all.push_back(std::to_string(o.seed));
  number(o.baseline_m);
  number(o.gain);
  all.push_back(o.title);
  all.push_back(NameOf(o.lamp));
  for (const double x : o.axis) number(x);
  for (const double x : o.drag_newton_s_per_m) number(x);
  for (int i = 0; i < 6; ++i) number(o.gains(i / 3, i % 3));
  for (const double x : o.limits_v) number(x);
  all.push_back(std::to_string(o.distances_m.size()));
  for (const double x : o.distances_m) number(x);
  auto water = [&](const Water& w) {
    number(w.milk_ml_m3);
    number(w.scatter_scale);
  };
  water(o.water);
  all.push_back(std::to_string(o.balls.size()));
  for (const Ball& ball : o.balls) {
    all.push_back(ball.name);
    number(ball.radius_m);
    for (const double x : ball.p_m) number(x);
    water(ball.inside);
  }
  return all;
}

inline OneOfEverything Load(const std::string& text) {
  OneOfEverything object;
  ReadFields(ParseYaml(text, "a.yaml"), &object, nullptr);
  return object;
}

inline std::string LoadError(const std::string& text) {
  return testing::MessageOf([&] { Load(text); });
}

template <class T>
void ApplySet(const std::string& assignment, T* object, Origins* origins) {
  for (const auto& [key, place] : SetLayers({ParseAssignment(assignment)}, object))
    if (origins) (*origins)[key] = place;
}

inline std::string SetError(const std::string& assignment) {
  OneOfEverything object;
  return testing::MessageOf([&] { ApplySet(assignment, &object, nullptr); });
}

// A file that is gone when the test ends.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& text)
      : path_(std::filesystem::path(::testing::TempDir()) / ("yaml_fields_" + name)) {
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace turbidock::config
