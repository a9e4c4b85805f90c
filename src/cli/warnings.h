/* Warnings, gathered by kind: one line for many that differ in names and numbers only. */
#ifndef CLI_WARNINGS_H
#define CLI_WARNINGS_H

#include <stdbool.h>

/* From here on warnings wait for cli_warnings_tell(). `all` prints each at once, `quiet` none. Without this
 * call each is printed at once. */
void cli_warnings_begin(bool all, bool quiet);

/* Adds a warning, "file.glb: mesh 'sail': 4 open edges: …". For vsh_run; any thread. */
void cli_warnings_parse(void *user, const char *message);

/* Adds a warning of the program's own. */
void cli_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Prints the warnings that wait, one line a kind, in the order in which the kinds came first. Call it at the
 * end of a stage, and before an error is printed. */
void cli_warnings_tell(void);

#endif
