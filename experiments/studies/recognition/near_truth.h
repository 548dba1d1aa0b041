#pragma once
// F near the true pose: what the experiment's search ends with, without the search. For a
// calibration, which asks a thousand times.
//
// Light is linear in what shines: a cell is lit once for each source of unit strength and, under
// other strengths, another sensor or another matching of colours, only exposed anew. F of a frame
// is the best of some hundred poses, most of them about the true one; the rest, farther away, find
// what noise happens to agree with when the marker is lost. That is within 0.04 of F by the search.

#include <map>
#include <string>
#include <vector>

#include "experiments/studies/recognition/recognition.h"
#include "sim/light/radiance.h"

namespace turbidock::recognition {

class NearTruth {
 public:
  // Of these cells, which `recognition`, that must outlive it, has drawn. Frames count from one.
  NearTruth(const Recognition& recognition, int frames);

  // The cells' light under the scenarios that `recognition` has now: computed anew where more than
  // the strength of lamps and balls has changed. ConfigError for snow and lenses,
  // which it does not know.
  void Light();
  // Under the same scenarios; deterministic.
  CellResult RunCell(size_t cell) const;

 private:
  // What the cameras see about the marker by what shines with unit strength, and the mean over all
  // of both images by channel, which automatic exposure wants.
  struct Source {
    Stereo<Eigen::ArrayXf> rows;  // whole rows of the region, channels together
    Eigen::Array3d mean = Eigen::Array3d::Zero();
  };
  struct CellLight {
    std::string of;  // the light's parameters but for the strengths
    StereoRegion region;
    Source lamps, rim, core;  // empty where it is off
  };
  static Source Shine(const trial::FixedView& view, const light::OpticsParams& params,
                      const StereoRegion& region);

  const Recognition& recognition_;
  int frames_;
  std::vector<CellLight> lights_;        // by cell
  std::vector<std::vector<Pose>> X_HM_;  // by cell: where F is looked for
};

}  // namespace turbidock::recognition
