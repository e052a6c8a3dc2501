// The component, for main.c and the tests.

#include <armor.h>

extern const armor_component component;
