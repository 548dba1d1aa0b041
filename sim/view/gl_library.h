#pragma once
// Opening a library that draws, at run time: a machine without it can still run everything else.

#include <dlfcn.h>

#include <initializer_list>
#include <string>

#include "sim/base/check.h"

namespace turbidock::view {

// Opens the first of `names` that is there. Never closed: MuJoCo keeps the addresses of GL
// functions for good. SimulatorFault with `package` to install when there is none.
inline void* OpenGlLibrary(std::initializer_list<const char*> names, const std::string& title,
                           const std::string& package) {
  for (const char* name : names)
    if (void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL)) return library;
  throw SimulatorFault("cannot render: the " + title + " library (" + *names.begin() +
                       ") is missing or unusable; install the package " + package);
}

// Shows a library to MuJoCo, which looks for its functions among the process's and takes the first
// of several libraries, usable or not: so only once a context works. `symbol` is any of it.
inline void ShowToMujoco(const void* symbol) {
  Dl_info library;
  if (dladdr(symbol, &library) != 0) dlopen(library.dli_fname, RTLD_NOW | RTLD_GLOBAL);
}

template <class Function>
void LoadSymbol(void* library, const char* name, Function* function) {
  *function = reinterpret_cast<Function>(dlsym(library, name));
  if (*function == nullptr)
    throw SimulatorFault(std::string("the library that draws has no function ") + name);
}

// What glGetString says in the current context, such as GL_RENDERER. `get_string` may be null.
inline std::string GlText(const unsigned char* (*get_string)(unsigned int), unsigned int name) {
  const unsigned char* text = get_string == nullptr ? nullptr : get_string(name);
  return text == nullptr ? "?" : reinterpret_cast<const char*>(text);
}

}  // namespace turbidock::view
