#include "sim/view/gl_functions.h"

#include <string>

#include "sim/base/check.h"

namespace turbidock::view {

GlFunctions::GlFunctions(const GlContext& context) {
  const auto load = [&](const char* name, auto* function) {
    *function = reinterpret_cast<std::remove_pointer_t<decltype(function)>>(context.Function(name));
    if (*function == nullptr)
      throw SimulatorFault(std::string("OpenGL has no ") + name + " (" + context.description() +
                           ")");
  };
// NOLINTNEXTLINE(bugprone-macro-parentheses): a member's name
#define TURBIDOCK_GL_LOAD(name) load("gl" #name, &name);
  TURBIDOCK_GL_FUNCTIONS(TURBIDOCK_GL_LOAD)
#undef TURBIDOCK_GL_LOAD
}

}  // namespace turbidock::view
