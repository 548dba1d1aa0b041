#pragma once
// Images from disk, one after the other: what a recorded camera saw.

#include <memory>
#include <string>
#include <vector>

#include "sim/base/image.h"

namespace turbidock::media {

// What a video says of itself.
struct VideoTimes {
  std::vector<double> times_s;  // when its images are shown, in their order; none: unknown
  std::string cut_off;          // why there should be more of them; empty when there should not
};

class ImageSource {
 public:
  virtual ~ImageSource() = default;
  // The next image, 8-bit RGB; false after the last one. ConfigError for one that cannot be read.
  virtual bool Next(Image3u8* image) = 0;
  // Whether it holds one image only, as a file of a still image does.
  virtual bool is_still() const = 0;
  // Complete after the last image.
  virtual VideoTimes times() const { return {}; }
};

// The files that a name means, below: one, those of a folder or a pattern, or none.
std::vector<std::string> FilesOf(const std::string& name);

// Opens what the name means: a still image (PNG by libpng, others by ffmpeg), a folder or a shell
// pattern of images (in the order of their names, numbers in them by their value), or a video (by
// ffmpeg). ConfigError when there is nothing of that name.
std::unique_ptr<ImageSource> OpenImages(const std::string& name);

// The images of two cameras, pair by pair. Numbers in the names of files, and times of videos, must
// agree to half a step: other files are refused, other images of videos left out.
class ImagePairs {
 public:
  // ConfigError when there is nothing of a name, or files are no pairs: the same file twice, or, of
  // sides whose files have some numbers in common (or names, where they have none), two with
  // different ones.
  explicit ImagePairs(const Stereo<std::string>& names);

  // The next pair; false after the last one.
  bool Next(StereoImage* pair);
  bool is_still() const { return sources_.left->is_still(); }
  // After the last pair: why there should be more; empty when there should not.
  const std::string& incomplete() const { return incomplete_; }
  // What a user should know of the pairs so far: sentences.
  std::vector<std::string> notes() const;

 private:
  Stereo<std::string> names_;
  Stereo<std::unique_ptr<ImageSource>> sources_;
  Stereo<std::vector<double>> times_s_;
  Stereo<size_t> seen_;
  Stereo<bool> has_left_out_;
  double tolerance_s_ = 0;
  double step_ = 0;            // between images of a side: seconds of films, else of names' numbers
  std::vector<double> apart_;  // by how much the images of pairs differ, likewise
  std::vector<std::string> notes_;
  std::string incomplete_;
};

}  // namespace turbidock::media
