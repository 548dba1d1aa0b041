#pragma once
// Light over a picture from few points. Where one surface is seen light is smooth: it is bilinear
// between the corners of a tile if the tile's middle agrees (a shadow, the edge of a beam, a ball's
// glow may be in it); if not, the tile's quarters are done, down to single pixels.
//
// Corners lie on a lattice and are shared by the tiles that meet there. A tile whose far corner
// belongs to another surface uses its own last pixel instead.

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sim/base/image.h"
#include "sim/light/scattering.h"

namespace turbidock::light {

// A pixel at which light is asked for.
struct LightPoint {
  uint16_t u, v;
  uint16_t surface;  // as in RenderedView
  float depth_m;
};

// Which surface is seen where, coarsely: for squares of 4, 8, ... pixels the one surface that they
// show, or that they show several.
class SurfacePyramid {
 public:
  static constexpr int kCell_px = 4;
  static constexpr uint16_t kMixed = 0xffff;

  // Looks at the squares that a region touches.
  void Build(const Image1u16& surface, const PixelRegion& region);
  // Of the square with this corner; sizes are kCell_px times a power of two, corners multiples.
  uint16_t At(int u0, int v0, int size_px) const;

 private:
  std::vector<Image1u16> levels_;
  std::vector<uint16_t> low_, high_;  // extremes over a row of cells, by column
};

// How a kind of light is spread over tiles.
struct TileRules {
  int largest_px = 16;           // rounded down to a power of two; below 4 every pixel is computed
  int mixed_px = 0;              // tiles not larger than this may show several surfaces
  bool nothing_is_dark = false;  // no light where no surface is seen
  float relative_tolerance = 0.01f, absolute_tolerance = 0;
};

// The tiles of one picture and the light at their corners.
class TiledLight {
 public:
  // Computes the light at points.
  using Shine = std::function<void(std::span<const LightPoint> points, Light* light)>;

  // Divides a region of a view into tiles and computes what they need. Keeps its memory.
  void Spread(const Image1u16& surface, const Image1f& depth_m, const SurfacePyramid& pyramid,
              const PixelRegion& region, const TileRules& rules, const Shine& shine);

  // Writes (or adds) the light of rows [row_begin, row_end) into rows that start at column 0 of row
  // `row_begin`, each its red values, then green and blue (negative by rounding at most). Row_begin
  // is a multiple of kBandRows, and at most kBandRows are painted. With kWrite all pixels of the
  // region are written; with kAdd dark ones are left.
  static constexpr int kBandRows = 16;
  enum class Mode { kWrite, kAdd };
  void Paint(int row_begin, int row_end, Mode mode, float* rgb) const;

  // Points at which light was computed: the work done.
  int64_t points() const { return static_cast<int64_t>(points_.size()); }

 private:
  struct Tile {
    int16_t u0, v0, size_px;
    uint16_t surface;
    int corner[4];  // indices of points: top left, top right, bottom left, bottom right
    int middle;
  };
  struct Leaf {
    int16_t u0, v0, u1, v1;  // the corners' pixels
    int16_t width, height;   // painted, from (u0, v0)
    bool pixels;             // each pixel has its own point, from corner[0] on
    bool dark;
    int corner[4];
  };

  void Reserve(size_t pixels, size_t bands);
  void Consider(int u0, int v0, int size_px);
  int PointAt(int u, int v);
  int OwnPoint(int u, int v);
  void AddPixels(int u0, int v0, int size_px);
  void AddLeaf(const Leaf& leaf);
  bool MiddleAgrees(const Tile& tile) const;

  const Image1u16* surface_ = nullptr;
  const Image1f* depth_m_ = nullptr;
  const SurfacePyramid* pyramid_ = nullptr;
  TileRules rules_;
  PixelRegion region_;
  int width_ = 0, lattice_columns_ = 0;
  std::vector<int> lattice_;  // index of the point at each node, -1: none yet
  std::vector<LightPoint> points_;
  std::vector<Light> light_;
  std::vector<Tile> open_, tested_;
  std::vector<Leaf> leaves_;
  std::vector<std::vector<int>> leaves_of_band_;
};

}  // namespace turbidock::light
