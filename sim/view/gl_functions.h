#pragma once
// The OpenGL functions that we call ourselves, taken from a context by name: what draws is chosen
// at run time, so nothing is linked.

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include "sim/view/gl_context.h"

namespace turbidock::view {

#define TURBIDOCK_GL_FUNCTIONS(F) \
  F(AttachShader)                 \
  F(BindBuffer)                   \
  F(BindFramebuffer)              \
  F(BindRenderbuffer)             \
  F(BindVertexArray)              \
  F(BufferData)                   \
  F(CheckFramebufferStatus)       \
  F(ClearBufferfv)                \
  F(ClearBufferuiv)               \
  F(ClipControl)                  \
  F(CompileShader)                \
  F(CreateProgram)                \
  F(CreateShader)                 \
  F(DeleteBuffers)                \
  F(DeleteFramebuffers)           \
  F(DeleteProgram)                \
  F(DeleteRenderbuffers)          \
  F(DeleteShader)                 \
  F(DeleteVertexArrays)           \
  F(DepthFunc)                    \
  F(Disable)                      \
  F(DrawElements)                 \
  F(Enable)                       \
  F(EnableVertexAttribArray)      \
  F(Finish)                       \
  F(FramebufferRenderbuffer)      \
  F(FrontFace)                    \
  F(GenBuffers)                   \
  F(GenFramebuffers)              \
  F(GenRenderbuffers)             \
  F(GenVertexArrays)              \
  F(GetProgramInfoLog)            \
  F(GetProgramiv)                 \
  F(GetUniformLocation)           \
  F(LinkProgram)                  \
  F(PixelStorei)                  \
  F(ReadPixels)                   \
  F(RenderbufferStorage)          \
  F(Scissor)                      \
  F(ShaderSource)                 \
  F(Uniform1f)                    \
  F(UseProgram)                   \
  F(VertexAttribIPointer)         \
  F(VertexAttribPointer)          \
  F(Viewport)

struct GlFunctions {
  // SimulatorFault names what the context has not got.
  explicit GlFunctions(const GlContext& context);

// NOLINTNEXTLINE(bugprone-macro-parentheses): a name
#define TURBIDOCK_GL_MEMBER(name) decltype(&gl##name) name = nullptr;
  TURBIDOCK_GL_FUNCTIONS(TURBIDOCK_GL_MEMBER)
#undef TURBIDOCK_GL_MEMBER
};

}  // namespace turbidock::view
