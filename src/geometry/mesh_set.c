#include "geometry/mesh_set.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "geometry/alpha_mask.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/mesh.h>

const struct vsh_checked_mesh *vshi_mesh_known(const vsh_mesh *mesh) {
    const struct vsh_checked_mesh *known = mesh->checked;
    if (known == NULL) {
        return NULL;
    }
    const vsh_mesh *of = &known->of;
    return mesh->positions == of->positions && mesh->indices == of->indices &&
                   mesh->vertex_count == of->vertex_count && mesh->triangle_count == of->triangle_count &&
                   mesh->object == of->object && mesh->solidity == of->solidity && mesh->mask == of->mask &&
                   mesh->mask_uvs == of->mask_uvs && vshi_mesh_same_transform(mesh->transform, of->transform)
               ? known
               : NULL;
}

const uint8_t *vshi_mesh_sides(const vsh_mesh *mesh) {
    const struct vsh_checked_mesh *known = vshi_mesh_known(mesh);
    return known != NULL && known->solidity != NULL ? vshi_solidity_sides(known->solidity, known->place)
                                                    : NULL;
}

vsh_result vshi_mesh_check_data(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    return vshi_mesh_known(mesh) != NULL ? VSH_OK : vshi_mesh_validate(mesh, index, error);
}

/* Validates a mesh, and fills the report except for its edges. */
static vsh_result check_mesh(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report, vsh_error *error) {
    VSHI_TRY(vshi_mesh_validate(mesh, index, error));
    *report = (vsh_mesh_report){.bounds_min = {DBL_MAX, DBL_MAX, DBL_MAX},
                                .bounds_max = {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (vshi_mesh_degenerate(mesh, i)) {
            ++report->degenerate_triangles;
            continue;
        }
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        report->area += vshi_triangle_area(corner);
        for (int k = 0; k < 3; ++k) {
            vshi_grow_box(report->bounds_min, report->bounds_max, corner[k]);
        }
    }
    return VSH_OK;
}

vsh_result vshi_mesh_set_create(const vsh_mesh *given, size_t count, vshi_mesh_set *set, vsh_error *error) {
    *set = (vshi_mesh_set){0};
    VSHI_TRY(vshi_meshes_tighten(given, count, &set->tight, error));
    const vsh_mesh *meshes = set->tight.meshes;
    VSHI_TRY(vshi_allocate((void **)&set->meshes, count, sizeof *set->meshes, "meshes", error));
    VSHI_TRY(vshi_allocate((void **)&set->checked, count, sizeof *set->checked, "meshes", error));
    set->count = count;
    for (size_t m = 0; m < count; ++m) {
        const struct vsh_checked_mesh *known = vshi_mesh_known(&meshes[m]);
        struct vsh_checked_mesh *own = &set->checked[m];
        if (known != NULL) {
            *own = *known;
        } else {
            VSHI_TRY(check_mesh(&meshes[m], m, &own->report, error));
        }
        set->meshes[m] = meshes[m];
        if (meshes[m].mask != NULL) {
            VSHI_TRY(vshi_alpha_mask_check(&meshes[m], m, error));
            set->meshes[m].solidity = VSH_SOLIDITY_SHELL;
            set->meshes[m].alpha = VSH_ALPHA_MASKED;
        }
        own->of = set->meshes[m];
        set->meshes[m].checked = own;
    }
    return VSH_OK;
}

void vshi_mesh_set_free(vshi_mesh_set *set) {
    vshi_solidity_free(set->own);
    free(set->checked);
    free(set->meshes);
    free(set->tight.memory);
    *set = (vshi_mesh_set){0};
}

/* The solidity of exactly these meshes, in this order; NULL if they were not analysed together. */
static const vshi_solidity *known_together(const vshi_mesh_set *set) {
    const vshi_solidity *solidity = set->count > 0 ? set->checked[0].solidity : NULL;
    if (solidity == NULL || solidity->mesh_count != set->count) {
        return NULL;
    }
    for (size_t m = 0; m < set->count; ++m) {
        if (set->checked[m].solidity != solidity || set->checked[m].place != m) {
            return NULL;
        }
    }
    return solidity;
}

vsh_result vshi_mesh_set_solve(vshi_mesh_set *set, const vsh_run *run, vsh_error *error) {
    if (set->solidity == NULL) {
        set->solidity = known_together(set);
    }
    if (set->solidity != NULL) {
        return VSH_OK;
    }
    vsh_run quiet = *run;
    quiet.progress = NULL;
    VSHI_TRY(vshi_solidity_create(set->meshes, set->count, &quiet, &set->own, error));
    set->solidity = set->own;
    for (size_t m = 0; m < set->count; ++m) {
        if (set->checked[m].solidity == NULL) {
            set->checked[m].solidity = set->own;
            set->checked[m].place = m;
        }
    }
    return VSH_OK;
}

/* --- reports and notes */

/* Adds a component to its object's report. */
static void add_component(const vshi_component *c, vsh_solidity_report *report) {
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
    const vshi_solidity *s = set.solidity;
    for (size_t w = 0; w < s->wholes.count; ++w) {
        vsh_solidity_report report = {0};
        for (size_t i = s->first[w]; i < s->first[w + 1]; ++i) {
            add_component(&s->components[i], &report);
        }
        for (size_t m = s->wholes.first[w]; m < s->wholes.first[w + 1]; ++m) {
            reports[m] = report;
        }
    }
done:
    vshi_mesh_set_free(&set);
    return result;
}

static const char *plural(size_t count) {
    return count == 1 ? "" : "s";
}

void vshi_mesh_set_note(const vshi_mesh_set *set, double shell, double voxel, const vsh_run *run) {
    const vshi_solidity *s = set->solidity;
    char as[96] = "a sheet, with air on both sides";
    if (shell > 0.0) {
        snprintf(as, sizeof as, "a shell %g voxels (%g units) thick", shell, shell * voxel);
    }
    for (size_t w = 0; vshi_wants_notes(run) && w < s->wholes.count; ++w) {
        const vsh_mesh *whole = &s->wholes.meshes[w];
        if (whole->alpha == VSH_ALPHA_MASKED && whole->solidity == VSH_SOLIDITY_SHELL) {
            continue; /* masked meshes are sheets on purpose */
        }
        const size_t first = s->wholes.first[w], count = s->first[w + 1] - s->first[w];
        vsh_solidity_report t = {0};
        size_t sheet_edges = 0;
        bool around_all = false;
        for (const vshi_component *c = s->components + s->first[w]; c < s->components + s->first[w + 1];
             ++c) {
            add_component(c, &t);
            sheet_edges += c->kind == VSHI_KIND_SHEET ? c->open_edges : 0;
            around_all = around_all || c->around_all;
        }
        char name[220];
        snprintf(name, sizeof name, "%s (%zu of %zu)", vshi_mesh_label(&set->meshes[first], first).text,
                 first + 1, set->count);
        if (around_all) {
            vshi_note(run, "%s: everything else lies within it: baked as a shell with air on both sides",
                      name);
        }
        if (t.sheets + t.open_solids > 0 && sheet_edges == 0 && !around_all) {
            vshi_note(run, "%s: no volume between its faces: baked as %s", name, as);
        }
        if (sheet_edges > 0) {
            vshi_note(run, "%s: %zu open edge%s: baked as %s", name, sheet_edges, plural(sheet_edges), as);
        }
        if (t.closed_over > 0) {
            vshi_note(
                run,
                "%s: %zu open edge%s around %zu hole%s in %zu of %zu component%s that enclose nearly all "
                "behind them: treated as solid, closed over the holes",
                name, t.open_edges, plural(t.open_edges), t.holes, plural(t.holes), t.closed_over, count,
                plural(count));
        }
        if (t.turned_triangles > 0) {
            vshi_note(
                run,
                "%s: %zu triangle%s that face the other way than their neighbours: treated as turned over",
                name, t.turned_triangles, plural(t.turned_triangles));
        }
    }
}

vsh_result vsh_mesh_check(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(mesh, report);
    vsh_mesh_report found;
    vshi_tight_meshes tight;
    vsh_result result;
    VSHI_TRY_DONE(vshi_meshes_tighten(mesh, 1, &tight, error));
    VSHI_TRY_DONE(check_mesh(tight.meshes, VSHI_MESH_ALONE, &found, error));
    VSHI_TRY_DONE(vshi_mesh_count_edges(tight.meshes, &found, error));
    *report = found;
done:
    free(tight.memory);
    return result;
}
