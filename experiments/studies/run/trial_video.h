#pragma once
// The film of a trial: what the cameras saw, what the estimator made of it, and how it went so far.

#include <string>
#include <vector>

#include "experiments/media/canvas.h"
#include "experiments/media/panel_chart.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_record.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/image.h"
#include "vision/overlay.h"

namespace turbidock::run {

inline constexpr int kVideoWidth = 1280, kVideoHeight = 720;

// What one frame of the film shows. The balls are those of the estimated pose, in pixels of the
// images.
struct VideoFrame {
  const StereoImage& images;
  const Stereo<std::vector<vision::ProjectedBall>>& balls;
  const trial::FrameRecord& record;
  const Image3u8* spectator = nullptr;  // the scene from outside
};

// Composes the pictures, 1280 x 720: both camera images with the estimated marker as circles (the
// inner one dotted, in the ball's colour) and below them the spectator's view beside the trial's
// panels of F, x, y and z (trace_panels.h) so far.
class VideoComposer {
 public:
  explicit VideoComposer(const trial::Scenario& scenario);

  // The picture of the next frame; it stays valid until the next call.
  const media::Canvas& Compose(const VideoFrame& frame);
  // The last picture with how it ended across it.
  const media::Canvas& Conclude(const std::string& outcome, const std::string& reason);

 private:
  void DrawStatus(const trial::FrameRecord& record);
  void DrawCharts();
  void DrawLegend();

  trial::ViewCriteria criteria_;
  std::string title_;
  double envelope_ratio_;  // radius of the model's outer circle over that of the ball
  media::Canvas canvas_;
  trial::Series series_;                   // so far
  std::vector<media::PanelChart> charts_;  // of kCharts
};

}  // namespace turbidock::run
