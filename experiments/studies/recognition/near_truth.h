#pragma once
// F near the true pose: what the experiment's search ends with, without the search. For a
// calibration, which asks a thousand times.
//
// F of a frame is the best of some hundred poses, most of them about the true one; the rest,
// farther away, find what noise happens to agree with when the marker is lost. That is within 0.04
// of F by the search.

#include "experiments/studies/recognition/recognition.h"

namespace turbidock::recognition {

// A cell that `recognition` has drawn, of so many frames. Deterministic.
CellResult RunNearTruth(const Recognition& recognition, const RecognitionCell& cell, int frames);

}  // namespace turbidock::recognition
