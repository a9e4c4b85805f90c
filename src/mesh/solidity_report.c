#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh_set.h"

#include <vdbshade/solidity.h>

static void add(const vshi_component *c, vsh_solidity_report *report) {
    size_t *const counts[] = {[VSHI_KIND_SHEET] = &report->sheets,
                              [VSHI_KIND_SOLID] = &report->solids,
                              [VSHI_KIND_ROOM] = &report->rooms,
                              [VSHI_KIND_WALL] = &report->walls};
    ++*(c->vessel ? &report->open_solids : counts[c->kind]);
    report->turned_triangles += c->turned;
    if (c->open_edges > 0 && (c->kind == VSHI_KIND_SOLID || c->kind == VSHI_KIND_ROOM)) {
        ++report->closed_over;
        report->holes += c->holes;
        report->open_edges += c->open_edges;
    }
}

vsh_result vsh_mesh_solidity(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                             vsh_solidity_report *reports, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_OF(mesh_count, meshes);
    VSHI_NEEDS_OF(mesh_count, reports);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_mesh_set set;
    vsh_result result;
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, mesh_count, &set, error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(&set, &full, error));
    const vshi_wholes *wholes = vshi_solidity_wholes(set.solidity);
    for (size_t w = 0; w < wholes->count; ++w) {
        vsh_solidity_report report = {0};
        size_t count;
        const vshi_component *components = vshi_solidity_of_whole(set.solidity, w, &count);
        for (size_t i = 0; i < count; ++i) {
            add(&components[i], &report);
        }
        for (size_t m = wholes->first[w]; m < wholes->first[w + 1]; ++m) {
            reports[m] = report;
        }
    }
done:
    vshi_mesh_set_free(&set);
    return result;
}
