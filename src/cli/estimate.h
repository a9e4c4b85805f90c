/* How much of a whole command is done, and how long the rest takes: from what its stages were expected to
 * take, and what those took that are over. Knows no clock and prints nothing. */
#ifndef CLI_ESTIMATE_H
#define CLI_ESTIMATE_H

#include <stdbool.h>

enum { CLI_ESTIMATE_STAGES = 256, CLI_ESTIMATE_NAME = 80 };

/* Stages whose errors go together: where one took longer than expected, so will the others. */
enum { CLI_ESTIMATE_SHAPE, CLI_ESTIMATE_SHADE, CLI_ESTIMATE_FILE, CLI_ESTIMATE_KINDS };

typedef struct cli_expected {
    char name[CLI_ESTIMATE_NAME];
    int kind;
    double seconds; /* expected */
    double took;    /* once it is over */
    bool over, skipped;
} cli_expected;

/* Begins as zeros. */
typedef struct cli_estimate {
    cli_expected stages[CLI_ESTIMATE_STAGES];
    int count;
    cli_expected past[8]; /* stages that were over before they were expected */
    int past_count;
    int current;                  /* -1: a stage that was not expected */
    bool running;                 /* a stage has begun */
    char name[CLI_ESTIMATE_NAME]; /* of the stage under way */
    double began, fraction;       /* of it */
    double first;                 /* when the command began */
    double shown;                 /* the largest share told: it never falls */
} cli_estimate;

/* The command begins. */
void cli_estimate_begin(cli_estimate *estimate, double now);

/* A stage that is to come, behind those expected so far, and what it takes, about; or one that has been
 * already, which tells how fast the others will be. Stages beyond the room are left out. */
void cli_estimate_expect(cli_estimate *estimate, const char *name, int kind, double seconds);

/* A stage is so far, 0 … 1. A name that differs, or the same one from its beginning, ends the stage before
 * it. */
void cli_estimate_report(cli_estimate *estimate, const char *name, double fraction, double now);

/* Seconds left; below 0 where nothing was expected, so that nobody knows. */
double cli_estimate_left(const cli_estimate *estimate, double now);

/* Share of the command that is done, 0 … 1, or of the stage where nothing was expected. */
double cli_estimate_share(cli_estimate *estimate, double now);

#endif
