#include "experiments/app/main.h"

int main(int argc, char** argv) { return turbidock::Main(argc, argv); }
