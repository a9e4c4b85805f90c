/* Modules: parts of this library that are loaded when the first call needs them, for what loads with them. */
#ifndef VSHI_MODULE_H
#define VSHI_MODULE_H

#include <vdbshade/base.h>

/* A module's table, whose first member is the vsh_version() it was built with, as a const char *; NULL where
 * it cannot be had, with the reason in `reason`, cut to fit. `file` is looked for beside this library, and
 * then as every library is. Never unloaded. */
const void *vshi_module_table(const char *file, const char *symbol, char *reason, size_t reason_size);

#endif
