#include "sim/view/surface_canvas.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "sim/base/check.h"

namespace turbidock::view {
namespace {

enum Kind { kFacets, kBalls };

constexpr const char* kFacetVertexShader = R"(#version 330
layout(location = 0) in vec4 clip;
layout(location = 1) in uint surface;
flat out uint of_surface;
void main() {
  gl_Position = clip;
  of_surface = surface;
}
)";
constexpr const char* kFacetFragmentShader = R"(#version 330
flat in uint of_surface;
out uint surface;
void main() { surface = of_surface; }
)";

constexpr const char* kBallVertexShader = R"(#version 330
layout(location = 0) in vec2 clip;
layout(location = 1) in vec2 ray;
layout(location = 2) in vec4 ball;
layout(location = 3) in uint surface;
out vec2 of_ray;
flat out vec4 of_ball;
flat out uint of_surface;
void main() {
  gl_Position = vec4(clip, 0.5, 1.0);
  of_ray = ray;
  of_ball = ball;
  of_surface = surface;
}
)";
// The nearer crossing of a ray t d with the sphere: first the ray's point nearest to the centre, so
// that no large squares are subtracted.
constexpr const char* kBallFragmentShader = R"(#version 330
in vec2 of_ray;
flat in vec4 of_ball;
flat in uint of_surface;
uniform float near;
out uint surface;
void main() {
  vec3 d = vec3(of_ray, 1.0);
  float d2 = dot(d, d);
  float t = dot(d, of_ball.xyz) / d2;
  vec3 off = of_ball.xyz - t * d;
  float h2 = of_ball.w * of_ball.w - dot(off, off);
  if (h2 <= 0.0) discard;
  float z = t - sqrt(h2 / d2);
  if (z < near) discard;
  surface = of_surface;
  gl_FragDepth = near / z;
}
)";

}  // namespace

SurfaceCanvas::SurfaceCanvas(GlContext& context, int width_px, int height_px, int views,
                             int most_surface, float near_m)
    : context_(context),
      gl_((context.MakeCurrent(), context)),
      width_px_(width_px),
      height_px_(height_px),
      bytes_(most_surface <= 255) {
  gl_.GenFramebuffers(1, &framebuffer_);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl_.GenRenderbuffers(2, renderbuffers_.data());
  const auto attach = [&](GLuint renderbuffer, GLenum format, GLenum attachment) {
    gl_.BindRenderbuffer(GL_RENDERBUFFER, renderbuffer);
    gl_.RenderbufferStorage(GL_RENDERBUFFER, format, width_px, views * height_px);
    gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, renderbuffer);
  };
  attach(renderbuffers_[0], bytes_ ? GL_R8UI : GL_R16UI, GL_COLOR_ATTACHMENT0);
  attach(renderbuffers_[1], GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw SimulatorFault("OpenGL gives no framebuffer of " + std::to_string(width_px) + " x " +
                         std::to_string(views * height_px) + " pixels (" + context_.description() +
                         ")");
  gl_.BindRenderbuffer(GL_RENDERBUFFER, 0);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);

  programs_ = {LinkProgram(kFacetVertexShader, kFacetFragmentShader),
               LinkProgram(kBallVertexShader, kBallFragmentShader)};
  gl_.UseProgram(programs_[kBalls]);
  gl_.Uniform1f(gl_.GetUniformLocation(programs_[kBalls], "near"), near_m);
  gl_.UseProgram(0);
  gl_.GenVertexArrays(2, vertex_arrays_.data());
  gl_.GenBuffers(2, corner_buffers_.data());
  gl_.GenBuffers(2, index_buffers_.data());
  for (const int kind : {kFacets, kBalls}) MakeVertexArray(kind);
}

SurfaceCanvas::~SurfaceCanvas() {
  context_.MakeCurrent();
  gl_.DeleteBuffers(2, index_buffers_.data());
  gl_.DeleteBuffers(2, corner_buffers_.data());
  gl_.DeleteVertexArrays(2, vertex_arrays_.data());
  for (const GLuint program : programs_) gl_.DeleteProgram(program);
  gl_.DeleteRenderbuffers(2, renderbuffers_.data());
  gl_.DeleteFramebuffers(1, &framebuffer_);
}

GLuint SurfaceCanvas::LinkProgram(const char* vertex_shader, const char* fragment_shader) {
  const GLuint program = gl_.CreateProgram();
  const auto attach = [&](GLenum stage, const char* source) {
    const GLuint shader = gl_.CreateShader(stage);
    gl_.ShaderSource(shader, 1, &source, nullptr);
    gl_.CompileShader(shader);
    gl_.AttachShader(program, shader);
    gl_.DeleteShader(shader);  // once the program is gone
  };
  attach(GL_VERTEX_SHADER, vertex_shader);
  attach(GL_FRAGMENT_SHADER, fragment_shader);
  gl_.LinkProgram(program);
  GLint linked = 0;
  gl_.GetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == 0) {
    std::array<char, 1000> log{};
    gl_.GetProgramInfoLog(program, std::ssize(log), nullptr, log.data());
    throw SimulatorFault("OpenGL does not accept our shaders (" + context_.description() +
                         "): " + log.data());
  }
  return program;
}

void SurfaceCanvas::MakeVertexArray(int kind) {
  gl_.BindVertexArray(vertex_arrays_[kind]);
  gl_.BindBuffer(GL_ARRAY_BUFFER, corner_buffers_[kind]);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffers_[kind]);
  // OpenGL takes offsets into the bound buffer as pointers.
  // NOLINTBEGIN(performance-no-int-to-ptr)
  const auto floats = [&](GLuint location, int count, int stride, size_t offset) {
    gl_.EnableVertexAttribArray(location);
    gl_.VertexAttribPointer(location, count, GL_FLOAT, GL_FALSE, stride,
                            reinterpret_cast<const void*>(offset));
  };
  const auto number = [&](GLuint location, int stride, size_t offset) {
    gl_.EnableVertexAttribArray(location);
    gl_.VertexAttribIPointer(location, 1, GL_UNSIGNED_INT, stride,
                             reinterpret_cast<const void*>(offset));
  };
  // NOLINTEND(performance-no-int-to-ptr)
  if (kind == kFacets) {
    using Corner = SurfaceList::Corner;
    floats(0, 4, sizeof(Corner), offsetof(Corner, clip));
    number(1, sizeof(Corner), offsetof(Corner, surface));
  } else {
    using Corner = SurfaceList::BallCorner;
    floats(0, 2, sizeof(Corner), offsetof(Corner, clip));
    floats(1, 2, sizeof(Corner), offsetof(Corner, ray));
    floats(2, 4, sizeof(Corner), offsetof(Corner, ball_m));
    number(3, sizeof(Corner), offsetof(Corner, surface));
  }
  gl_.BindVertexArray(0);
  gl_.BindBuffer(GL_ARRAY_BUFFER, 0);
}

void SurfaceCanvas::Begin() {
  context_.MakeCurrent();
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl_.Disable(GL_BLEND);
  gl_.Disable(GL_STENCIL_TEST);
  gl_.Disable(GL_SCISSOR_TEST);
  constexpr std::array<GLuint, 4> kNoSurface{};
  constexpr float kInfinitelyFar = 0;
  gl_.ClearBufferuiv(GL_COLOR, 0, kNoSurface.data());
  gl_.ClearBufferfv(GL_DEPTH, 0, &kInfinitelyFar);
  gl_.Enable(GL_SCISSOR_TEST);
  gl_.Enable(GL_CULL_FACE);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_GREATER);
  gl_.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  gl_.FrontFace(GL_CW);  // as y is turned
}

void SurfaceCanvas::End() {
  gl_.BindVertexArray(0);
  gl_.BindBuffer(GL_ARRAY_BUFFER, 0);
  gl_.UseProgram(0);
  gl_.ClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  gl_.FrontFace(GL_CCW);
  gl_.DepthFunc(GL_LESS);
  gl_.Disable(GL_DEPTH_TEST);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_SCISSOR_TEST);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

void SurfaceCanvas::Draw(int view, const PixelRegion& region, const SurfaceList& list) {
  gl_.Viewport(0, view * height_px_, width_px_, height_px_);
  gl_.Scissor(region.column_begin, view * height_px_ + region.row_begin, region.width(),
              region.height());
  const auto draw = [&](Kind kind, const auto& corners, const std::vector<uint32_t>& triangles) {
    if (triangles.empty()) return;
    gl_.UseProgram(programs_[kind]);
    gl_.BindVertexArray(vertex_arrays_[kind]);
    gl_.BindBuffer(GL_ARRAY_BUFFER, corner_buffers_[kind]);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof corners[0]),
                   corners.data(), GL_STREAM_DRAW);
    gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER,
                   static_cast<GLsizeiptr>(triangles.size() * sizeof triangles[0]),
                   triangles.data(), GL_STREAM_DRAW);
    gl_.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(triangles.size()), GL_UNSIGNED_INT,
                     nullptr);
  };
  draw(kFacets, list.corners, list.triangles);
  draw(kBalls, list.ball_corners, list.ball_triangles);
}

void SurfaceCanvas::Read(int view, const PixelRegion& region, Image1u16* surface,
                         Image1f* nearness) {
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);  // for good: MuJoCo sets the same once and relies on it
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, width_px_);
  const int x = region.column_begin, y = view * height_px_ + region.row_begin;
  const auto read = [&](GLenum format, GLenum type, void* first) {
    gl_.ReadPixels(x, y, region.width(), region.height(), format, type, first);
  };
  if (bytes_) {
    read_.Resize(width_px_, height_px_);
    read(GL_RED_INTEGER, GL_UNSIGNED_BYTE, read_.at(region.column_begin, region.row_begin));
    for (int v = region.row_begin; v < region.row_end; ++v)
      std::copy_n(read_.at(region.column_begin, v), region.width(),
                  surface->at(region.column_begin, v));
  } else {
    read(GL_RED_INTEGER, GL_UNSIGNED_SHORT, surface->at(region.column_begin, region.row_begin));
  }
  read(GL_DEPTH_COMPONENT, GL_FLOAT, nearness->at(region.column_begin, region.row_begin));
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
}

}  // namespace turbidock::view
