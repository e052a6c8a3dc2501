// What a test asserts, in C and C++.

#include <stdio.h>
#include <stdlib.h>

#define CHECK(condition)                                                                      \
  do {                                                                                        \
    if (!(condition)) {                                                                       \
      fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #condition, armor_last_error()); \
      exit(1);                                                                                \
    }                                                                                         \
  } while (0)
#define CHECK_OK(call) CHECK((call) == ARMOR_ERROR_NONE)
#define CHECK_FAILS(call, code, text)                             \
  do {                                                            \
    CHECK((call) == (code));                                      \
    if (strstr(armor_last_error(), text) == NULL) {               \
      fprintf(stderr, "%s:%d: `%s` is not in `%s`\n", __FILE__, __LINE__, text, armor_last_error()); \
      exit(1);                                                    \
    }                                                             \
  } while (0)
