#pragma once
// The program: command line in, exit code out. See `turbidock --help`. A program with controllers
// and estimators of its own is this one with plug-ins (experiments/trial/plugin_of.h):
//
//   int main(int argc, char** argv) {
//     turbidock::trial::Plugins plugins;
//     plugins.AddController<MyController>("my_controller");
//     return turbidock::Main(argc, argv, plugins);
//   }

#include "experiments/trial/plugins.h"

namespace turbidock {

int Main(int argc, char** argv, const trial::Plugins& plugins = {});

}  // namespace turbidock
