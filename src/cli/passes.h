/* How long AO between texels takes yet: it comes in passes, of which the later ones are cheaper, and after
 * each a part of the texels is interpolated at once, so that its fraction jumps. */
#ifndef CLI_PASSES_H
#define CLI_PASSES_H

/* Begins as zeros, with `last` the time. */
typedef struct cli_passes {
    double last, fraction;
    double worked, working; /* of the fraction, without jumps; seconds that it took */
    double after;           /* the fraction behind the first pass and its jump; 0: that goes on */
    double share;           /* of what the first pass left open, that was interpolated */
} cli_passes;

void cli_passes_report(cli_passes *passes, double fraction, double now);

/* How much is known of the pace, 0 … 1, and the seconds left by it. */
double cli_passes_known(const cli_passes *passes);
double cli_passes_left(const cli_passes *passes);

#endif
