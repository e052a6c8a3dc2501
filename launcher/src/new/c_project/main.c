#include "component.h"

int main(int argc, char **argv) {
  return armor_run(argc, argv, &component);
}
