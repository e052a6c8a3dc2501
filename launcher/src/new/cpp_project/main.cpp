#include "component.hpp"

int main(int argc, char **argv) {
  return armor::run<{{Type}}>(argc, argv);
}
