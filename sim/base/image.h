#pragma once
// Images: contiguous rows, top row first, channels interleaved, no padding.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/base/stereo.h"

namespace turbidock {

using Rgb = std::array<uint8_t, 3>;  // an 8-bit colour: red, green, blue

template <class T, int kChannels>
class Image {
 public:
  using Value = T;
  static constexpr int channels = kChannels;

  Image() = default;
  Image(int width, int height, T fill = T{}) { Resize(width, height, fill); }

  // Keeps the memory when the size does not change.
  void Resize(int width, int height, T fill = T{}) {
    if (width == width_ && height == height_) return;
    width_ = width;
    height_ = height;
    data_.assign(static_cast<size_t>(width) * height * kChannels, fill);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  size_t pixels() const { return static_cast<size_t>(width_) * height_; }
  bool empty() const { return data_.empty(); }
  bool Contains(int u, int v) const { return u >= 0 && v >= 0 && u < width_ && v < height_; }

  T* data() { return data_.data(); }
  const T* data() const { return data_.data(); }
  T* row(int v) { return data_.data() + static_cast<size_t>(v) * width_ * kChannels; }
  const T* row(int v) const { return data_.data() + static_cast<size_t>(v) * width_ * kChannels; }
  // Pointer to the channels of pixel (u, v); no bounds check.
  T* at(int u, int v) { return row(v) + static_cast<size_t>(u) * kChannels; }
  const T* at(int u, int v) const { return row(v) + static_cast<size_t>(u) * kChannels; }

  bool operator==(const Image&) const = default;

 private:
  int width_ = 0, height_ = 0;
  std::vector<T> data_;
};

using Image1u8 = Image<uint8_t, 1>;
using Image3u8 = Image<uint8_t, 3>;  // RGB
using Image1u16 = Image<uint16_t, 1>;
using Image1f = Image<float, 1>;
using Image3f = Image<float, 3>;  // linear R, G, B

// A rectangle of pixels; the end column and row are outside.
struct PixelRegion {
  int column_begin = 0, row_begin = 0, column_end = 0, row_end = 0;

  int width() const { return column_end - column_begin; }
  int height() const { return row_end - row_begin; }
  bool empty() const { return width() <= 0 || height() <= 0; }
  bool Contains(int u, int v) const {
    return u >= column_begin && v >= row_begin && u < column_end && v < row_end;
  }
  bool operator==(const PixelRegion&) const = default;
};

using StereoRegion = Stereo<PixelRegion>;

// What the two cameras saw at one frame, 8-bit RGB: the only thing that passes from the simulation
// (or from a real vehicle) to the estimator.
struct StereoImage : Stereo<Image3u8> {
  int64_t frame = 0;
};

}  // namespace turbidock
