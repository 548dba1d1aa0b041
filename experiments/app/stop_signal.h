#pragma once
// Ctrl-C and kill: long work polls for them and ends cleanly.

namespace turbidock::app {

// From here on SIGINT and SIGTERM only ask the program to stop. A second one does not wait.
void CatchStopSignals();

// The signal that asked the program to stop, or 0.
int StopSignal();

}  // namespace turbidock::app
