#include "sim/light/tiles.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "sim/base/check.h"
#include "sim/base/vector_clones.h"

namespace turbidock::light {
namespace {

constexpr int kCell = SurfacePyramid::kCell_px;
constexpr int kCellShift = std::countr_zero(static_cast<unsigned>(kCell));
static_assert(kCell == 1 << kCellShift, "PointAt finds the lattice by masks");
constexpr uint16_t kMixed = SurfacePyramid::kMixed;

// The smallest and largest id in each cell of a row of cells.
TURBIDOCK_VECTOR_CLONES
void ColumnExtremes(const uint16_t* const rows[kCell], int begin, int end, uint16_t* low,
                    uint16_t* high) {
  const uint16_t *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
  for (int u = begin; u < end; ++u) {
    low[u] = std::min(std::min(a[u], b[u]), std::min(c[u], d[u]));
    high[u] = std::max(std::max(a[u], b[u]), std::max(c[u], d[u]));
  }
}

// From those of columns to those of cells: the one id in each, or kMixed.
TURBIDOCK_VECTOR_CLONES
void IdsOfCells(const uint16_t* __restrict low, const uint16_t* __restrict high, int begin, int end,
                uint16_t* __restrict out) {
  for (int i = begin; i < end; ++i) {
    const uint16_t* l = low + kCell * i;
    const uint16_t* h = high + kCell * i;
    const uint16_t least = std::min(std::min(l[0], l[1]), std::min(l[2], l[3]));
    const uint16_t most = std::max(std::max(h[0], h[1]), std::max(h[2], h[3]));
    out[i] = least == most ? least : kMixed;
  }
}

// One channel of bilinear light over a rectangle: at the left end of its upper and lower edge, what
// it changes by from column to column there, and the share of the way down that a row is.
struct Slopes {
  float upper, upper_right, lower, lower_right, per_row;
};

// So many values side by side.
template <int kCount>
using Values [[gnu::vector_size(kCount * sizeof(float))]] = float;

// Some columns of a rectangle, from its column `first` on: vectors of kWidth, kTimes of them. Tiles
// are too narrow for a compiler to make vectors of their rows by itself.
template <int kWidth, int kTimes = 1>
[[gnu::always_inline]] inline void PaintColumns(const Slopes& at, int first, int row_from,
                                                int row_to, ptrdiff_t stride, bool add,
                                                float* out) {
  using V = Values<kWidth>;
  V light[kTimes], down[kTimes];
  for (int part = 0; part < kTimes; ++part) {
    V x;
    for (int i = 0; i < kWidth; ++i) x[i] = static_cast<float>(part * kWidth + i);
    x += static_cast<float>(first);
    const V top = at.upper + x * at.upper_right;
    down[part] = (at.lower + x * at.lower_right - top) * at.per_row;
    light[part] = top + static_cast<float>(row_from) * down[part];
  }
  for (int row = row_from; row < row_to; ++row, out += stride)
    for (int part = 0; part < kTimes; ++part) {
      V sum = light[part], before;
      if (add) {
        std::memcpy(&before, out + part * kWidth, sizeof before);
        sum += before;
      }
      std::memcpy(out + part * kWidth, &sum, sizeof sum);
      light[part] += down[part];
    }
}

// Bilinear light over a rectangle (negative by rounding at most): corners of which the far ones may
// lie outside it. A row's channels are `plane` apart.
TURBIDOCK_VECTOR_CLONES
void PaintBilinear(const float* corners /* 4 x 4 */, int u_span, int v_span, int width,
                   int row_from, int row_to, int plane, bool add, float* rgb) {
  const float per_column = u_span > 0 ? 1.0f / static_cast<float>(u_span) : 0.0f;
  const float per_row = v_span > 0 ? 1.0f / static_cast<float>(v_span) : 0.0f;
  const ptrdiff_t stride = static_cast<ptrdiff_t>(3) * plane;
  for (int k = 0; k < 3; ++k, rgb += plane) {
    const Slopes at = {corners[k], (corners[4 + k] - corners[k]) * per_column, corners[8 + k],
                       (corners[12 + k] - corners[8 + k]) * per_column, per_row};
    int u = 0;
    for (; u + 32 <= width; u += 32)
      PaintColumns<8, 4>(at, u, row_from, row_to, stride, add, rgb + u);
    for (; u + 16 <= width; u += 16)
      PaintColumns<8, 2>(at, u, row_from, row_to, stride, add, rgb + u);
    for (; u + 8 <= width; u += 8) PaintColumns<8>(at, u, row_from, row_to, stride, add, rgb + u);
    for (; u + 4 <= width; u += 4) PaintColumns<4>(at, u, row_from, row_to, stride, add, rgb + u);
    for (; u < width; ++u) PaintColumns<1>(at, u, row_from, row_to, stride, add, rgb + u);
  }
}

// Light of `count` pixels of a row, a multiple of kWidth.
template <int kWidth>
void PaintPixels(const Light* light, int count, int plane, bool add, float* rgb) {
  for (const Light* end = light + count; light < end; light += kWidth, rgb += kWidth)
    for (int k = 0; k < 3; ++k) {
      float* out = rgb + static_cast<ptrdiff_t>(k) * plane;
      Values<kWidth> sum{}, before{};
      for (int i = 0; i < kWidth; ++i) sum[i] = light[i][k];
      std::memcpy(&before, out, sizeof before);
      if (add) sum += before;
      std::memcpy(out, &sum, sizeof sum);
    }
}

}  // namespace

void SurfacePyramid::Build(const Image1u16& surface, const PixelRegion& region) {
  const int width = surface.width(), height = surface.height();
  int columns = (width + kCell - 1) / kCell, rows = (height + kCell - 1) / kCell;
  if (levels_.empty()) levels_.resize(7);  // squares of 4 to 256
  std::vector<Image1u16>& levels = levels_;
  levels[0].Resize(columns, rows);
  // extremes of whole rows of cells, then across
  low_.resize(static_cast<size_t>(columns) * kCell);
  high_.resize(low_.size());
  PixelRegion cells = {region.column_begin / kCell, region.row_begin / kCell,
                       (region.column_end + kCell - 1) / kCell,
                       (region.row_end + kCell - 1) / kCell};
  for (int j = cells.row_begin; j < cells.row_end; ++j) {
    const uint16_t* of_row[kCell];
    for (int k = 0; k < kCell; ++k) of_row[k] = surface.row(std::min(j * kCell + k, height - 1));
    const int end = std::min(cells.column_end * kCell, width);
    ColumnExtremes(of_row, cells.column_begin * kCell, end, low_.data(), high_.data());
    for (int u = end; u < cells.column_end * kCell; ++u) {
      low_[u] = low_[end - 1];
      high_[u] = high_[end - 1];
    }
    IdsOfCells(low_.data(), high_.data(), cells.column_begin, cells.column_end, levels[0].row(j));
  }
  for (size_t level = 1; level < levels.size(); ++level) {
    const Image1u16& below = levels[level - 1];
    columns = (columns + 1) / 2;
    rows = (rows + 1) / 2;
    levels[level].Resize(columns, rows);
    cells = {cells.column_begin / 2, cells.row_begin / 2, (cells.column_end + 1) / 2,
             (cells.row_end + 1) / 2};
    for (int j = cells.row_begin; j < cells.row_end; ++j) {
      const uint16_t* upper = below.row(2 * j);
      const uint16_t* lower = below.row(std::min(2 * j + 1, below.height() - 1));
      uint16_t* out = levels[level].row(j);
      for (int i = cells.column_begin; i < cells.column_end; ++i) {
        const int left = 2 * i, right = std::min(2 * i + 1, below.width() - 1);
        const uint16_t id = upper[left];
        out[i] = id == upper[right] && id == lower[left] && id == lower[right] ? id : kMixed;
      }
    }
  }
}

uint16_t SurfacePyramid::At(int u0, int v0, int size_px) const {
  const int shift = std::countr_zero(static_cast<unsigned>(size_px));
  return *levels_[static_cast<size_t>(shift - kCellShift)].at(u0 >> shift, v0 >> shift);
}

void TiledLight::Spread(const Image1u16& surface, const Image1f& depth_m,
                        const SurfacePyramid& pyramid, const PixelRegion& region,
                        const TileRules& rules, const Shine& shine) {
  surface_ = &surface;
  depth_m_ = &depth_m;
  pyramid_ = &pyramid;
  rules_ = rules;
  region_ = region;
  const int width = surface.width(), height = surface.height();
  width_ = width;
  lattice_columns_ = (width + kCell - 1) / kCell + 1;
  const int lattice_rows = (height + kCell - 1) / kCell + 1;
  lattice_.resize(static_cast<size_t>(lattice_columns_) * lattice_rows);
  points_.clear();
  leaves_.clear();
  const auto bands = static_cast<size_t>((height + kBandRows - 1) / kBandRows);
  if (leaves_of_band_.size() != bands) Reserve(surface.pixels(), bands);
  for (std::vector<int>& band : leaves_of_band_) band.clear();
  tested_.clear();

  const int largest_px =
      std::max(kCell, static_cast<int>(std::bit_floor(static_cast<unsigned>(rules.largest_px))));
  const auto down = [&](int x) { return x - x % largest_px; };
  // the nodes of the rows that tiles may touch
  const auto row_of_nodes = [&](int row) {
    return lattice_.begin() + static_cast<ptrdiff_t>(lattice_columns_) * row;
  };
  std::fill(row_of_nodes(down(region.row_begin) / kCell),
            row_of_nodes(std::min((region.row_end + largest_px) / kCell + 1, lattice_rows)), -1);
  for (int v = down(region.row_begin); v < region.row_end; v += largest_px)
    for (int u = down(region.column_begin); u < region.column_end; u += largest_px)
      Consider(u, v, largest_px);
  // tiles of which the middle disagrees open their quarters, until none does
  size_t computed = 0;
  while (true) {
    light_.resize(points_.size());
    shine(std::span(points_).subspan(computed), light_.data() + computed);
    computed = points_.size();
    if (tested_.empty()) break;
    open_.swap(tested_);
    tested_.clear();
    for (const Tile& tile : open_) {
      const int half = tile.size_px / 2;
      if (MiddleAgrees(tile)) {
        const LightPoint& far = points_[static_cast<size_t>(tile.corner[3])];
        Leaf leaf{.u0 = tile.u0,
                  .v0 = tile.v0,
                  .u1 = static_cast<int16_t>(far.u),
                  .v1 = static_cast<int16_t>(far.v),
                  .width = static_cast<int16_t>(std::min<int>(tile.size_px, width - tile.u0)),
                  .height = static_cast<int16_t>(std::min<int>(tile.size_px, height - tile.v0)),
                  .pixels = false,
                  .dark = true,
                  .corner = {}};
        for (int i = 0; i < 4; ++i) {
          leaf.corner[i] = tile.corner[i];
          leaf.dark = leaf.dark && (light_[static_cast<size_t>(tile.corner[i])] == 0).all();
        }
        AddLeaf(leaf);
      } else if (half < kCell) {
        AddPixels(tile.u0, tile.v0, tile.size_px);
      } else {
        for (const int dv : {0, half})
          for (const int du : {0, half}) Consider(tile.u0 + du, tile.v0 + dv, half);
      }
    }
  }
}

// Memory for any picture of that size, so that no frame need ask for more: none is taken before it
// is written. Tiles are not smaller than cells.
void TiledLight::Reserve(size_t pixels, size_t bands) {
  const size_t cells = lattice_.size();
  points_.reserve(pixels);
  light_.reserve(pixels);
  leaves_.reserve(cells);
  open_.reserve(cells);
  tested_.reserve(cells);
  leaves_of_band_.resize(bands);
  for (std::vector<int>& band : leaves_of_band_)
    band.reserve(static_cast<size_t>(lattice_columns_) * (kBandRows / kCell));
}

// Opens a tile, or its quarters where it shows several surfaces.
void TiledLight::Consider(int u0, int v0, int size_px) {
  if (u0 >= region_.column_end || v0 >= region_.row_end || u0 + size_px <= region_.column_begin ||
      v0 + size_px <= region_.row_begin)
    return;
  const uint16_t id = pyramid_->At(u0, v0, size_px);
  const int width = surface_->width(), height = surface_->height();
  if (rules_.nothing_is_dark && id == 0) {
    AddLeaf({.u0 = static_cast<int16_t>(u0),
             .v0 = static_cast<int16_t>(v0),
             .u1 = static_cast<int16_t>(u0),
             .v1 = static_cast<int16_t>(v0),
             .width = static_cast<int16_t>(std::min(size_px, width - u0)),
             .height = static_cast<int16_t>(std::min(size_px, height - v0)),
             .pixels = false,
             .dark = true,
             .corner = {}});
    return;
  }
  if (rules_.largest_px < kCell) {
    AddPixels(u0, v0, size_px);
    return;
  }
  if (id == kMixed && size_px > rules_.mixed_px) {
    const int half = size_px / 2;
    if (half < kCell) {
      AddPixels(u0, v0, size_px);
      return;
    }
    for (const int dv : {0, half})
      for (const int du : {0, half}) Consider(u0 + du, v0 + dv, half);
    return;
  }
  int u1 = std::min(u0 + size_px, width - 1), v1 = std::min(v0 + size_px, height - 1);
  if (id != kMixed) {
    if (*surface_->at(u1, v1) != id || *surface_->at(u1, v0) != id || *surface_->at(u0, v1) != id) {
      u1 = std::min(u0 + size_px, width) - 1;
      v1 = std::min(v0 + size_px, height) - 1;
    }
  }
  tested_.push_back({.u0 = static_cast<int16_t>(u0),
                     .v0 = static_cast<int16_t>(v0),
                     .size_px = static_cast<int16_t>(size_px),
                     .surface = id,
                     .corner = {PointAt(u0, v0), PointAt(u1, v0), PointAt(u0, v1), PointAt(u1, v1)},
                     .middle = PointAt((u0 + u1) / 2, (v0 + v1) / 2)});
}

// The point at a pixel, shared if it lies on the lattice.
int TiledLight::PointAt(int u, int v) {
  const bool on_lattice = ((u | v) & (kCell - 1)) == 0;
  if (!on_lattice) return OwnPoint(u, v);
  const int place = (v >> kCellShift) * lattice_columns_ + (u >> kCellShift);
  int& index = lattice_[static_cast<size_t>(place)];
  if (index < 0) index = OwnPoint(u, v);
  return index;
}

int TiledLight::OwnPoint(int u, int v) {
  points_.push_back({.u = static_cast<uint16_t>(u),
                     .v = static_cast<uint16_t>(v),
                     .surface = *surface_->at(u, v),
                     .depth_m = *depth_m_->at(u, v)});
  return static_cast<int>(points_.size()) - 1;
}

void TiledLight::AddPixels(int u0, int v0, int size_px) {
  const int u_end = std::min(u0 + size_px, surface_->width());
  const int v_end = std::min(v0 + size_px, surface_->height());
  Leaf leaf{.u0 = static_cast<int16_t>(u0),
            .v0 = static_cast<int16_t>(v0),
            .u1 = static_cast<int16_t>(u_end - 1),
            .v1 = static_cast<int16_t>(v_end - 1),
            .width = static_cast<int16_t>(u_end - u0),
            .height = static_cast<int16_t>(v_end - v0),
            .pixels = true,
            .dark = false,
            .corner = {static_cast<int>(points_.size()), 0, 0, 0}};
  points_.resize(points_.size() + static_cast<size_t>(leaf.width) * leaf.height);
  LightPoint* point = &points_[static_cast<size_t>(leaf.corner[0])];
  for (int v = v0; v < v_end; ++v) {
    const uint16_t* surface = surface_->row(v);
    const float* depth_m = depth_m_->row(v);
    for (int u = u0; u < u_end; ++u)
      *point++ = {.u = static_cast<uint16_t>(u),
                  .v = static_cast<uint16_t>(v),
                  .surface = surface[u],
                  .depth_m = depth_m[u]};
  }
  AddLeaf(leaf);
}

void TiledLight::AddLeaf(const Leaf& leaf) {
  const int index = static_cast<int>(leaves_.size());
  leaves_.push_back(leaf);
  for (int band = leaf.v0 / kBandRows; band * kBandRows < leaf.v0 + leaf.height; ++band)
    leaves_of_band_[static_cast<size_t>(band)].push_back(index);
}

bool TiledLight::MiddleAgrees(const Tile& tile) const {
  const auto light = [&](int point) -> const Light& { return light_[static_cast<size_t>(point)]; };
  const auto place = [&](int point) -> const LightPoint& {
    return points_[static_cast<size_t>(point)];
  };
  const LightPoint &near = place(tile.corner[0]), &far = place(tile.corner[3]),
                   &middle = place(tile.middle);
  const float x = far.u > near.u
                      ? static_cast<float>(middle.u - near.u) / static_cast<float>(far.u - near.u)
                      : 0.0f;
  const float y = far.v > near.v
                      ? static_cast<float>(middle.v - near.v) / static_cast<float>(far.v - near.v)
                      : 0.0f;
  const Light top = light(tile.corner[0]) + x * (light(tile.corner[1]) - light(tile.corner[0]));
  const Light bottom = light(tile.corner[2]) + x * (light(tile.corner[3]) - light(tile.corner[2]));
  const Light error = light(tile.middle) - (top + y * (bottom - top));
  const Light allowed = rules_.relative_tolerance * light(tile.middle) + rules_.absolute_tolerance;
  return (error.abs() <= allowed).all();
}

void TiledLight::Paint(int row_begin, int row_end, Mode mode, float* rgb) const {
  TD_CHECK(row_begin % kBandRows == 0 && row_end - row_begin <= kBandRows, "no band of rows");
  const int stride = 3 * width_;
  const bool add = mode == Mode::kAdd;
  for (const int index : leaves_of_band_[static_cast<size_t>(row_begin / kBandRows)]) {
    const Leaf& leaf = leaves_[static_cast<size_t>(index)];
    if (leaf.dark && add) continue;
    const int from = std::max<int>(leaf.v0, row_begin),
              to = std::min(leaf.v0 + leaf.height, row_end);
    float* out = rgb + static_cast<ptrdiff_t>(from - row_begin) * stride + leaf.u0;
    if (leaf.dark) {
      for (int line = 0; line < 3 * (to - from); ++line, out += width_)
        std::fill_n(out, leaf.width, 0.0f);
    } else if (leaf.pixels) {
      const Light* light = &light_[static_cast<size_t>(leaf.corner[0])] +
                           static_cast<ptrdiff_t>(from - leaf.v0) * leaf.width;
      for (int v = from; v < to; ++v, out += stride, light += leaf.width)
        leaf.width == kCell ? PaintPixels<kCell>(light, kCell, width_, add, out)
                            : PaintPixels<1>(light, leaf.width, width_, add, out);
    } else {
      float corners[16] = {};
      for (int i = 0; i < 4; ++i)
        Eigen::Map<Light>(corners + 4 * i) = light_[static_cast<size_t>(leaf.corner[i])];
      PaintBilinear(corners, leaf.u1 - leaf.u0, leaf.v1 - leaf.v0, leaf.width, from - leaf.v0,
                    to - leaf.v0, width_, add, out);
    }
  }
}

}  // namespace turbidock::light
