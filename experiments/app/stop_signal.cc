#include "experiments/app/stop_signal.h"

#include <csignal>

namespace turbidock::app {
namespace {

// Written by the signal handler, which may touch nothing else.
volatile std::sig_atomic_t stop_signal = 0;

void OnSignal(int signal) {
  stop_signal = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

std::function<bool()> CatchStopSignals() {
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
  return [] { return stop_signal != 0; };
}

int StopSignal() { return stop_signal; }

}  // namespace turbidock::app
