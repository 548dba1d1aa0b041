#pragma once
// PNG files by libpng alone: the image files of OpenCV bring in two hundred shared libraries.

#include <string>

#include "sim/base/image.h"

namespace turbidock::media {

// 8-bit RGB. ConfigError when the path cannot be written, SimulatorFault when writing breaks off.
void WritePng(const std::string& path, const Image3u8& image);

// Any PNG, as 8-bit RGB (an alpha channel is laid over black). ConfigError when it cannot be read.
Image3u8 ReadPng(const std::string& path);

}  // namespace turbidock::media
