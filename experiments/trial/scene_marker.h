#pragma once
// The marker as the estimator knows it, and as it stands in the scene.

#include "experiments/trial/scenario.h"
#include "sim/vehicle/scene.h"
#include "vision/fiducial_marker.h"

namespace turbidock::trial {

// Takes the scene's balls, and the box that carries them, as those that the estimator knows; to a
// micrometre. A ball of a name that the scenario's marker has keeps its hue there; another has the
// hue of its light or else of its paint. ConfigError for one that has no hue.
void TakeBalls(const vehicle::Scene& scene, Scenario* scenario);

// Tags as an estimator knows them: whether they are to be taken from the scene; takes them
// (ConfigError without any; null: none are known); ConfigError when one is not where the scene has
// it.
bool TakesTags(const Scenario& scenario);
void TakeTags(const vehicle::Scene* scene, Scenario* scenario);
void CheckTags(const Scenario& scenario, const vehicle::Scene& scene);

// MJCF that draws a marker's tags, for inclusion where the marker frame M is: of each a site, as
// TakeTags wants it, and matt black and white sheets on a plate, as models/fiducial.xml has them.
std::string TagsMjcf(const vision::FiducialParams& fiducial);

// ConfigError when a ball of the marker as the estimator knows it is not where the scene has it, to
// a millimetre, or one of the two has no such ball; unless the scenario says that they may differ.
// Likewise for what else the estimator knows of the scene.
void CheckMarker(const Scenario& scenario, const vehicle::Scene& scene);

}  // namespace turbidock::trial
