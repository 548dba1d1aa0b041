#pragma once
// Drawing surfaces by OpenGL into a framebuffer of two numbers a pixel: which surface is nearest,
// and how near. Row 0 is a picture's top row: y is turned when corners are projected, so that what
// is read needs no turning.

#include <array>

#include "sim/base/image.h"
#include "sim/view/gl_context.h"
#include "sim/view/gl_functions.h"
#include "sim/view/surface_list.h"

namespace turbidock::view {

class SurfaceCanvas {
 public:
  // Of width x height pixels for each of `views` pictures, with surfaces up to a number. (Up to 255
  // fit bytes, which Mesa clears many at a time.) SimulatorFault when OpenGL gives none.
  SurfaceCanvas(GlContext& context, int width_px, int height_px, int views, int most_surface,
                float near_m);
  ~SurfaceCanvas();
  SurfaceCanvas(const SurfaceCanvas&) = delete;
  SurfaceCanvas& operator=(const SurfaceCanvas&) = delete;

  // Makes the context current and sets what drawing needs; End leaves it as others expect it.
  void Begin();
  void End();
  // All else goes between Begin and End. Empties a part of a picture and draws a list there. What
  // lies outside is left as it was; what lies inside does not depend on the region.
  void Draw(int view, const PixelRegion& region, const SurfaceList& list);
  // Waits for what was drawn.
  void Finish() { gl_.Finish(); }
  // Copies a part of a picture into images of its size: surfaces, 0 where there is nothing, and
  // near_m / depth, 0 where there is nothing.
  void Read(int view, const PixelRegion& region, Image1u16* surface, Image1f* nearness);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  GLuint LinkProgram(const char* vertex_shader, const char* fragment_shader);
  void MakeVertexArray(int which);

  GlContext& context_;
  GlFunctions gl_;
  int width_px_, height_px_;
  bool bytes_;
  Image1u8 read_;  // surfaces as bytes
  GLuint framebuffer_ = 0;
  std::array<GLuint, 2> renderbuffers_{};  // surface, nearness
  // Of facets and of balls.
  std::array<GLuint, 2> programs_{}, vertex_arrays_{}, corner_buffers_{}, index_buffers_{};
};

}  // namespace turbidock::view
