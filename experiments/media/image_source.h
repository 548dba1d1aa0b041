#pragma once
// Images from disk, one after the other: what a recorded camera saw.

#include <memory>
#include <string>
#include <vector>

#include "sim/base/image.h"

namespace turbidock::media {

class ImageSource {
 public:
  virtual ~ImageSource() = default;
  // The next image, 8-bit RGB; false after the last one. ConfigError for one that cannot be read.
  virtual bool Next(Image3u8* image) = 0;
  // Whether it holds one image only, as a file of a still image does.
  virtual bool is_still() const = 0;
};

// The files that a name means, below: one, those of a folder or a pattern, or none.
std::vector<std::string> FilesOf(const std::string& name);

// ConfigError where the files of two names, taken in their order, are no pairs: the same file
// twice, or, of sides whose files have some numbers in common (or names, where they have none), two
// with different ones.
void RequirePairs(const std::string& left, const std::string& right);

// Opens what the name means: a still image (PNG by libpng, others by ffmpeg), a folder or a shell
// pattern of images (in the order of their names, numbers in them by their value), or a video (by
// ffmpeg). ConfigError when there is nothing of that name.
std::unique_ptr<ImageSource> OpenImages(const std::string& name);

}  // namespace turbidock::media
