#pragma once
// Conventions. Every other header points here.
//
// Notation (Drake's monogram): X_AB is the pose of frame B in A, so p_AQ = X_AB * p_BQ and adjacent
// letters cancel: X_WM = X_WH * X_HM. R_AB rotation, q_AB unit quaternion, p_AQ_E the position of Q
// from A expressed in E (E = A when left out), V_AB twist, F_B wrench on B. A trailing capital is
// always "expressed in", a trailing lower-case word is a unit. SI throughout.
//
//  | letter | frame              | axes and origin                                            |
//  |--------|--------------------|------------------------------------------------------------|
//  | W      | world              | z up, gravity along -z, still water surface at z = 0       |
//  | B      | vehicle body       | x forward, y left, z up; origin fixed in the vehicle's MJCF |
//  | H      | camera head        | as B; origin midway between the two optical centres         |
//  | L, R   | cameras, optical   | x right, y down, z forward; origin at the optical centre    |
//  | M      | marker             | axes as H when the vehicle faces it squarely; origin where  |
//  |        |                    | the normals through the balls' centres meet                 |
//  | D      | dock               | x = direction of insertion, z up; origin in the lead-in's   |
//  |        |                    | mouth                                                       |
//  | K      | moored body        | the body that holds marker and station, where it can move   |
//  | G      | MuJoCo camera      | x right, y up, looks along -z; only inside the renderer     |
//
// Quaternions are (w, x, y, z) in files and argument lists and are canonical (w >= 0) when logged,
// compared or hashed; (eps1, eps2, eps3) = (x, y, z). Pixels: (u, v), the centre of the top-left
// pixel is (0, 0), v grows downwards. Thruster commands are volts, 0..5, neutral 2.5. Twists and
// wrenches put the angular part first.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace turbidock {

// Rotation of an optical frame whose camera looks along the head's x axis: columns are the optical
// axes (right, down, forward) in H.
inline Eigen::Matrix3d HeadFromOptical() {
  Eigen::Matrix3d R_HL;
  R_HL << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R_HL;
}

// MuJoCo cameras look along -z with y up, optical frames along +z with y down: a half turn about x.
inline Eigen::Matrix3d OpticalFromMujocoCamera() { return Eigen::Vector3d(1, -1, -1).asDiagonal(); }

}  // namespace turbidock
