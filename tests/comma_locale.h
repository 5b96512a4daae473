/* A locale whose decimal point is a comma: one of the machine's, or one made by localedef (Debian's package `locales`)
 * in a folder of its own, to which LOCPATH then points. The whole process is in it afterwards. 0 where there is none.
 */
#ifndef SGRT_TESTS_COMMA_LOCALE_H
#define SGRT_TESTS_COMMA_LOCALE_H

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline int enter_comma_locale(void) {
  static const char* const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "nl_NL.UTF-8"};
  char folder[] = "/tmp/sgrt-locale-XXXXXX", command[256];
  size_t i;
  int made;
  for (i = 0; i < sizeof names / sizeof *names; ++i)
    if (setlocale(LC_ALL, names[i]) && !strcmp(localeconv()->decimal_point, ",")) return 1;
  if (!mkdtemp(folder)) return 0;
  snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 2> /dev/null", folder);
  made = system(command) == 0;
  setenv("LOCPATH", folder, 1);
  made = setlocale(LC_ALL, "de_DE.UTF-8") && made; /* read into memory: the folder can go */
  snprintf(command, sizeof command, "rm -r %s", folder);
  if (system(command) != 0) perror(folder);
  if (!made) setlocale(LC_ALL, "C");
  return made && !strcmp(localeconv()->decimal_point, ",");
}

#endif
