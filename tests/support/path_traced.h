#pragma once
// The path-traced stereo pairs of tests/data/pathtraced with their true poses.

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "experiments/media/png.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"

namespace turbidock::testing {

struct PathTracedPair {
  std::string name;
  double milk_ml_m3 = 0;
  Pose true_X_HM;
  StereoImage seen;
};

inline std::vector<PathTracedPair> PathTracedPairs() {
  const std::string folder = std::string(TURBIDOCK_TEST_DATA) + "/pathtraced/";
  std::vector<PathTracedPair> pairs;
  for (const char* list : {"active_21.json", "passive_22.json"}) {
    std::ifstream stream(folder + list);
    for (const auto& entry : nlohmann::json::parse(stream)) {
      const std::vector<double> p = entry.at("position_m"), q = entry.at("quaternion_wxyz");
      PathTracedPair pair;
      pair.name = entry.at("name");
      pair.milk_ml_m3 = entry.at("milk_ml_m3");
      pair.true_X_HM = {Eigen::Quaterniond(q.at(0), q.at(1), q.at(2), q.at(3)).normalized(),
                        Eigen::Vector3d(p.at(0), p.at(1), p.at(2))};
      pair.seen.left = media::ReadPng(folder + entry.at("left").get<std::string>());
      pair.seen.right = media::ReadPng(folder + entry.at("right").get<std::string>());
      pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

}  // namespace turbidock::testing
