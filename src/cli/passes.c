#include "passes.h"

/* The first pass shades every fourth texel of every fourth row. */
static const double FIRST = 0.0625;
/* Small charts have more of it, by this factor at most: their corners. */
static const double LONGEST = 2.0;
/* Of what it leaves open, so much is on the lattice of the second, */
static const double SECOND = 0.2;
/* and the texels of the third, whose values nothing is interpolated from, take this part of the first's time
 * each (src/bake/lattice.c; town, kitchen, fence, room, crates, a tree and an ogre at 1024², max-error 0.02).
 */
static const double THIRD = 0.45;
/* What scenes leave open after the first pass, and of that after the second, before either is known. */
static const double OPEN = 0.7, OPEN_AGAIN = 0.7;
/* The pace is taken over from the texels done so far only slowly: this much of it at the end. */
static const double OWN = 0.33;
/* A fraction that grows so much at once, and so many times as fast as before, was interpolated. */
static const double JUMP = 0.03, JUMP_PACE = 2.0;
/* Of the fraction, that a pace is known by. */
static const double LEAST = 0.005, ENOUGH = 0.03;

void cli_passes_report(cli_passes *p, double fraction, double now) {
    const double grown = fraction - p->fraction, took = now - p->last;
    if (!(grown > 0.0) || !(took > 0.0)) {
        return;
    }
    if (p->worked > 2.0 * LEAST && grown > JUMP && grown * p->working > JUMP_PACE * took * p->worked) {
        if (p->after <= 0.0) {
            p->share = grown / (1.0 - p->fraction);
            p->after = fraction;
        }
    } else {
        p->worked += grown;
        p->working += took;
        if (p->after <= 0.0 && fraction > LONGEST * FIRST) {
            p->after = FIRST;
        }
    }
    p->fraction = fraction;
    p->last = now;
}

double cli_passes_known(const cli_passes *p) {
    const double part = p->worked / ENOUGH;
    return p->worked < LEAST ? 0.0 : part < 1.0 ? part : 1.0;
}

double cli_passes_left(const cli_passes *p) {
    const double pace = p->worked > 0.0 ? p->working / p->worked : 0.0;
    if (p->after <= 0.0) {
        const double first = p->fraction < FIRST ? FIRST - p->fraction : 0.0;
        const double open = OPEN * (1.0 - FIRST);
        return pace * (first + open * (SECOND + THIRD * (1.0 - SECOND) * OPEN_AGAIN));
    }
    const double open = 1.0 - p->after, second = p->after + SECOND * open;
    if (p->fraction < second) {
        return pace * (second - p->fraction + THIRD * (1.0 - SECOND) * open * (1.0 - p->share));
    }
    const double part = second < 1.0 ? (p->fraction - second) / (1.0 - second) : 1.0;
    return pace * (1.0 - p->fraction) * (THIRD + OWN * part);
}
