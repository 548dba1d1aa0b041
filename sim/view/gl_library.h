#pragma once
// Opening a library that draws, at run time: a machine without it can still run everything else.

#include <dlfcn.h>

#include <cstdlib>
#include <initializer_list>
#include <string>

#include "sim/base/check.h"

namespace turbidock::view {

class GlLibrary {
 public:
  // Opens the first of `names` that is there. Never closed: MuJoCo keeps the addresses of GL
  // functions for good. SimulatorFault with `package` to install when there is none.
  GlLibrary(std::initializer_list<const char*> names, const std::string& title,
            const std::string& package) {
    setenv("LP_NUM_THREADS", "0", /*overwrite=*/1);  // llvmpipe's first context reads it
    for (const char* name : names)
      if ((library_ = dlopen(name, RTLD_NOW | RTLD_LOCAL)) != nullptr) return;
    throw SimulatorFault("cannot render: the " + title + " library (" + *names.begin() +
                         ") is missing or unusable; install the package " + package);
  }

  // Becomes a pointer to a function of whatever type is asked for.
  struct Symbol {
    void* address;
    template <class Function>
    operator Function*() const {  // NOLINT(google-explicit-constructor)
      return reinterpret_cast<Function*>(address);
    }
  };
  // SimulatorFault when it has no function of that name.
  Symbol operator[](const char* name) const {
    if (void* address = dlsym(library_, name)) return {address};
    throw SimulatorFault(std::string("the library that draws has no function ") + name);
  }

 private:
  void* library_ = nullptr;
};

// Shows a library to MuJoCo, which looks for its functions among the process's and takes the first
// of several libraries, usable or not: so only once a context works. `symbol` is any of it.
inline void ShowToMujoco(const void* symbol) {
  Dl_info library;
  if (dladdr(symbol, &library) != 0) dlopen(library.dli_fname, RTLD_NOW | RTLD_GLOBAL);
}

// "EGL, llvmpipe (...), OpenGL 4.5 (...)", of the current context. `get_string`: its glGetString,
// may be null.
inline std::string DescribeGl(const std::string& kind, void (*get_string)()) {
  constexpr unsigned int kRenderer = 0x1F01, kVersion = 0x1F02;
  const auto text = [&](unsigned int name) -> std::string {
    using GetString = const unsigned char* (*)(unsigned int);
    const auto* said = get_string ? reinterpret_cast<GetString>(get_string)(name) : nullptr;
    return said ? reinterpret_cast<const char*>(said) : "?";
  };
  return kind + ", " + text(kRenderer) + ", OpenGL " + text(kVersion);
}

}  // namespace turbidock::view
