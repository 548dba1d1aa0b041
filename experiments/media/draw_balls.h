#pragma once
// The published dotted circles: an estimated marker over a camera's image.

#include <vector>

#include "experiments/media/canvas.h"
#include "vision/overlay.h"

namespace turbidock::media {

// Draws the image into the panel and over it the balls, which are in its pixels: their outlines as
// dots, their envelopes as lines, faint where nothing is detected. `envelope_ratio`: the envelope's
// radius over the ball's.
void DrawBalls(const Image3u8& image, const std::vector<vision::ProjectedBall>& balls,
               bool is_detected, double envelope_ratio, const PixelRect& panel, Canvas* canvas);

}  // namespace turbidock::media
