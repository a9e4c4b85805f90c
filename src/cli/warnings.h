/* Warnings, gathered by kind: one line for many that differ in names and numbers only. */
#ifndef CLI_WARNINGS_H
#define CLI_WARNINGS_H

#include <stdbool.h>

/* From here on warnings are kept until cli_warnings_tell(); where all are wanted, or none (quiet), they are
 * told at once, or never. Without this call they are told at once. */
void cli_warnings_begin(bool all, bool quiet);

/* Takes one: "file.glb: mesh 'sail': 4 open edges: …". For vsh_run; any thread. */
void cli_warnings_parse(void *user, const char *message);

/* The same of one that the program makes. */
void cli_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Says what was kept, one line a kind, in the order in which kinds came first, and forgets it. To be called
 * where a stage is over, and before an error is told. */
void cli_warnings_tell(void);

#endif
