#pragma once
// PNG files by libpng alone: the image files of OpenCV bring in two hundred shared libraries.

#include <cstdint>
#include <string>

#include "sim/base/image.h"

namespace turbidock::media {

// Pixels of an image's side that are read at most: as a rig's cameras have.
inline constexpr int kLargestImage_px = 8192;

// ConfigError "FILE: W x H pixels, ..." for an image that is larger than that, or empty. To be
// asked before anything of that size is allocated.
void RequireImageSize(int64_t width_px, int64_t height_px, const std::string& file);

// 8-bit RGB, complete or not at all. ConfigError when the path cannot be written.
void WritePng(const std::string& path, const Image3u8& image);
void WritePng(const std::string& path, const Image1u8& image);   // grey
void WritePng(const std::string& path, const Image1u16& image);  // grey of 16 bits, as they are

// Any PNG, as 8-bit RGB (an alpha channel is laid over black), whatever it says of its colour
// space. ConfigError when it cannot be read.
Image3u8 ReadPng(const std::string& path);

}  // namespace turbidock::media
