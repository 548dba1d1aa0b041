#pragma once
// What a camera sees, drawn by MuJoCo's own renderer in its segmentation colours: the
// straightforward way, with facets instead of round balls.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "sim/view/rendered.h"
#include "tests/support/gl_canvas.h"

namespace turbidock::testing {

class MujocoVisibility {
 public:
  MujocoVisibility(view::GlContext& context, const vehicle::Scene& scene)
      : model_(*scene.model),
        canvas_(
            context, model_, scene.rig.left.width_px, scene.rig.left.height_px,
            {.shadowsize = 0, .offsamples = 0, .numslices = 40, .numstacks = 24, .numquads = 4}) {
    std::fill_n(canvas_.scene().flags, mjNRNDFLAG, mjtByte{0});
    canvas_.scene().flags[mjRND_SEGMENT] = 1;
    canvas_.scene().flags[mjRND_IDCOLOR] = 1;
    canvas_.scene().flags[mjRND_CULL_FACE] = 1;
  }

  view::RenderedView Render(const mjData& data, int camera) {
    const int width = canvas_.width_px(), height = canvas_.height_px();
    std::vector<uint8_t> rgb(static_cast<size_t>(3) * width * height);
    std::vector<float> depth(static_cast<size_t>(width) * height);
    canvas_.Update(data);
    mjvScene& drawn = canvas_.scene();
    for (int i = 0; i < drawn.ngeom; ++i)  // drawn in the colour (its segid) + 1
      drawn.geoms[i].segid = drawn.geoms[i].objtype == mjOBJ_GEOM ? drawn.geoms[i].objid : -1;
    canvas_.Draw(data, camera);
    canvas_.Read(rgb.data(), depth.data());

    const double near_m = model_.vis.map.znear * model_.stat.extent;
    const double far_m = model_.vis.map.zfar * model_.stat.extent;
    view::RenderedView view{Image1u16(width, height), Image1f(width, height)};
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const size_t pixel = static_cast<size_t>(height - 1 - v) * width + u;
        const int surface = rgb[3 * pixel] + 256 * rgb[3 * pixel + 1];
        *view.surface.at(u, v) = static_cast<uint16_t>(surface);
        *view.depth_m.at(u, v) =
            surface == 0 ? std::numeric_limits<float>::infinity()
                         : static_cast<float>(near_m * far_m /
                                              (near_m + (1 - depth[pixel]) * (far_m - near_m)));
      }
    return view;
  }

 private:
  const mjModel& model_;
  GlCanvas canvas_;
};

}  // namespace turbidock::testing
