#pragma once
// Success over a lattice of conditions as a smooth unknown function: what its trials say of it,
// drawn from the posterior.
//
// MODEL. A cell's log odds are a plane plus a Gaussian process, whose kernel is a product of
// exponentials over the axes: continuous, but nowhere smooth. A band covers what its prior is no
// smoother than (Knapik, van der Vaart and van Zanten, Ann. Stat. 39 (2011) 2626), and evidence
// cannot choose how smooth that is: it judges the whole lattice, so a smooth kernel wins where a
// boundary has one corner or steps, and is sure of the wrong side there. The plane has a wide
// prior, so a logistic line is in it. On a lattice its covariance is a Kronecker product: it is
// spanned by products of the eigenvectors of each axis, of which those with the largest eigenvalues
// are kept. (The same idea as the Hilbert-space basis of Solin and Sarkka, Stat. Comput. 30 (2020)
// 419, but optimal for the lattice and without a boundary beyond it.)
//
// INFERENCE. Laplace's approximation for the weights, for a few length scales and amplitudes; these
// are averaged by their evidence (Rasmussen and Williams, Gaussian Processes for Machine Learning,
// 2006, ch. 3.4 and 5.5). Draws of log odds are made monotone along the axes that are said to be:
// each is replaced by the nearest monotone function (Lin and Dunson, Biometrika 101 (2014) 303),
// cells weighted by how well they are known. At the tip of a corner that pulls them down a little.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "experiments/search/boundary_search.h"

namespace turbidock::search {

// How much log odds vary about the plane: as the trials say, which is as they do where most trials
// are; or much, for what is said of places with few trials, where they may do otherwise.
enum class Variation { kLearnt, kMuch };

// Log odds of success: a row for each cell of the lattice, a column for each draw. The same for the
// same tallies.
Eigen::MatrixXd DrawLogOdds(const Lattice& lattice, const std::vector<Tally>& tallies, int draws,
                            Variation variation = Variation::kLearnt);

// The nearest function, in weighted squares, that falls or rises along the axes that are said to:
// pool adjacent violators along one, Dykstra's alternating projections over several (Dykstra and
// Robertson, Ann. Stat. 10 (1982) 708).
void MakeMonotone(const Lattice& lattice, const Eigen::VectorXd& weights, Eigen::VectorXd* values);

}  // namespace turbidock::search
