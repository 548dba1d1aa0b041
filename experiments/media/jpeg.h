#pragma once
// Photographs, small.

#include <string>

#include "sim/base/image.h"

namespace turbidock::media {

// The image as a JPEG file's bytes; quality 1 to 100.
std::string EncodeJpeg(const Image3u8& image, int quality);

// Every second pixel of an image in each direction is the mean of four; the last row or column of
// an odd number is left out.
Image3u8 HalfSize(const Image3u8& image);

}  // namespace turbidock::media
