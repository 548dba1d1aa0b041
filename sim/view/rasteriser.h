#pragma once
// Drawing surfaces into a picture of two numbers a pixel: which surface is nearest, and how far. A
// pixel shows what the ray through its centre meets.

#include "sim/base/image.h"
#include "sim/view/rendered.h"
#include "sim/view/surface_list.h"

namespace turbidock::view {

// Empties a region of a view and draws a list there. Of surfaces equally near the first is shown;
// what is nearer than near_m is not. What lies outside the region is left as it was; what lies
// inside does not depend on the region.
void DrawSurfaces(const SurfaceList& list, float near_m, const PixelRegion& region,
                  RenderedView* view);

}  // namespace turbidock::view
