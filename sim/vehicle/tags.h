#pragma once
// The fiducial tags of a scene, if it has any: sites tag_NUMBER beside the marker.

#include <vector>

#include "sim/base/pose.h"
#include "sim/vehicle/scene.h"

namespace turbidock::vehicle {

struct TagInScene {
  int id = 0;  // its number in the family, from the site's name
  Pose X_MT;   // its frame in the marker frame: x into the tag, y left, z up as it is printed
  double size_m = 0;  // edge of the black square
};

// In the order of their numbers. ConfigError with the site's name for one that is no number, no
// square or not fixed to the marker.
std::vector<TagInScene> TagsOf(const Scene& scene);

// How bright, 0 to 1, the paint (green of geom_rgba; no material, no texture) of `across` times
// `across` places is that lie over a tag and its border, one of these places wide, row by row from
// the top left; 0 where nothing is there.
std::vector<float> BrightnessOf(const Scene& scene, const TagInScene& tag, int across);

}  // namespace turbidock::vehicle
