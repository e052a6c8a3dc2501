#include "ports.hpp"

int main(int argc, char **argv) { return armor::run<PoseFilterComponent>(argc, argv); }
