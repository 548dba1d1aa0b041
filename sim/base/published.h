#pragma once
// Numbers that the publication states and more than one part of the program reads.

namespace turbidock::published {

// Areas of recognition by the fitness F ("Area limits" in the publication):
//   Area I    F >= kReliableFitness                    docking is possible
//   Area II   kDetectedFitness <= F < kReliableFitness  recognisable, less reliable
//   Area III  F < kDetectedFitness                     not detected
inline constexpr double kDetectedFitness = 0.22;
inline constexpr double kReliableFitness = 0.60;

// A docking has succeeded when the marker is this near along x of the camera head H ...
inline constexpr double kDockDistance_m = 0.35;
// ... and no farther off to either side (|y|) or up and down (|z|).
inline constexpr double kDockTolerance_m = 0.04;

}  // namespace turbidock::published
