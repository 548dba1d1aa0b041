#pragma once
// The published dotted circles: an estimated marker over a camera's image.

#include <vector>

#include "experiments/media/canvas.h"
#include "vision/overlay.h"

namespace turbidock::media {

// Draws the balls' outlines as dots and their envelopes as lines over an image that fills `shown`
// at that scale. `envelope_ratio`: the envelope's radius over the ball's.
void DrawBalls(const std::vector<vision::ProjectedBall>& balls, const PixelRect& shown,
               double scale, double envelope_ratio, double alpha, Canvas* canvas);

}  // namespace turbidock::media
