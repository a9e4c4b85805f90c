/* Notes on solids, sheets and turned faces, one of a kind for each object. */
#include "base/job.h"
#include "mesh/mesh_set.h"

#include <stdio.h>

/* Counts the components of one object. */
typedef struct tally {
    size_t sheets, sheet_edges;
    size_t closed, closed_edges, holes; /* solids closed over their holes */
    size_t turned;
    bool around_all;
} tally;

static tally tally_of(const vshi_component *components, size_t count) {
    tally t = {0};
    for (size_t i = 0; i < count; ++i) {
        const vshi_component *c = &components[i];
        t.turned += c->turned;
        t.around_all = t.around_all || c->around_all;
        if (c->kind == VSHI_KIND_SHEET) {
            ++t.sheets;
            t.sheet_edges += c->open_edges;
        } else if (c->kind != VSHI_KIND_WALL && c->open_edges > 0) {
            ++t.closed;
            t.closed_edges += c->open_edges;
            t.holes += c->holes;
        }
    }
    return t;
}

static const char *plural(size_t count) {
    return count == 1 ? "" : "s";
}

void vshi_mesh_set_note(const vshi_mesh_set *set, double shell, double voxel, const vsh_run *run) {
    const vshi_wholes *wholes = vshi_solidity_wholes(set->solidity);
    char as[96] = "a sheet, with air on both sides";
    if (shell > 0.0) {
        snprintf(as, sizeof as, "a shell %g voxels (%g units) thick", shell, shell * voxel);
    }
    for (size_t w = 0; vshi_wants_notes(run) && w < wholes->count; ++w) {
        size_t count = 0;
        const vshi_component *components = vshi_solidity_of_whole(set->solidity, w, &count);
        const vsh_mesh *whole = &wholes->meshes[w];
        if (whole->alpha == VSH_ALPHA_MASKED && whole->solidity == VSH_SOLIDITY_SHELL) {
            continue; /* what a mask cuts out is meant so */
        }
        const tally t = tally_of(components, count);
        const size_t first = wholes->first[w];
        const vshi_mesh_name name = vshi_mesh_label(&set->meshes[first], first);
        if (t.around_all) {
            vshi_note(run,
                      "%s (%zu of %zu): everything else lies within it: baked as a shell with air on both "
                      "sides",
                      name.text, first + 1, set->count);
        }
        if (t.sheets > 0 && t.sheet_edges == 0 && !t.around_all) {
            vshi_note(run, "%s (%zu of %zu): no volume between its faces: baked as %s", name.text, first + 1,
                      set->count, as);
        }
        if (t.sheet_edges > 0) {
            vshi_note(run, "%s (%zu of %zu): %zu open edge%s: baked as %s", name.text, first + 1, set->count,
                      t.sheet_edges, plural(t.sheet_edges), as);
        }
        if (t.closed > 0) {
            vshi_note(run,
                      "%s (%zu of %zu): %zu open edge%s around %zu hole%s in %zu of %zu component%s that "
                      "enclose nearly all behind them: taken for solid, closed over the holes",
                      name.text, first + 1, set->count, t.closed_edges, plural(t.closed_edges), t.holes,
                      plural(t.holes), t.closed, count, plural(count));
        }
        if (t.turned > 0) {
            vshi_note(run,
                      "%s (%zu of %zu): %zu triangle%s that face the other way than those around: taken as "
                      "if they were turned over",
                      name.text, first + 1, set->count, t.turned, plural(t.turned));
        }
    }
}
