#pragma once
// The codes of the families of tags that the fiducial estimator reads, for its detector and for
// whoever draws a tag.

#include <memory>
#include <vector>

#include "vision/fiducial_marker.h"

struct apriltag_family;  // of libapriltag

namespace turbidock::vision {

// A family as libapriltag's detector wants it: AprilTag's own, or one of OpenCV's ArUco
// dictionaries, whose tags are squares with a black border of one cell as well.
using FamilyPtr = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;
FamilyPtr MakeFamily(TagFamily family);

// How many wrong cells the detector may put right without taking one tag for another: less than
// half of what two codes differ in, two at most.
int CorrectedCells(TagFamily family);

// How many tags a family has: their numbers begin at 0.
int TagCount(TagFamily family);

// A tag as it is printed: which of `across` times `across` cells are white, row by row from the top
// left. The outer ring is the white border, the next one the black border.
struct TagCells {
  int across = 0;
  std::vector<bool> white;

  bool operator()(int row, int column) const {
    const int cell = row * across + column;
    return white[static_cast<size_t>(cell)];
  }
};

// Of a tag that the family has.
TagCells CellsOf(TagFamily family, int id);

}  // namespace turbidock::vision
