#pragma once
// A few pictures of what both cameras saw in a trial, evenly over its time.

#include <cstdint>
#include <string>
#include <vector>

#include "sim/base/image.h"
#include "sim/base/stereo.h"

namespace turbidock::run {

class KeyFrames {
 public:
  // To be written into this folder, which is made, as FRAME_left.jpg and FRAME_right.jpg with six
  // digits. ConfigError when it cannot be made.
  KeyFrames(std::string folder, int frames_per_second);

  // Every so many frames a picture is wanted, at first; later only at multiples of that.
  int first_step() const { return first_step_; }

  // Keeps the images of this frame if they are wanted. They must be whole.
  void Add(int64_t frame, const StereoImage& images);

  struct Pictures {
    int64_t frame = 0;
    Stereo<std::string> jpeg;
  };
  const std::vector<Pictures>& pictures() const { return pictures_; }  // those kept, in order

  // Writes them; pictures of an earlier trial in the folder go.
  void Write() const;

 private:
  std::string folder_;
  int first_step_;
  int64_t step_;
  std::vector<Pictures> pictures_;
};

}  // namespace turbidock::run
