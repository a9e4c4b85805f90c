#include "mesh/solidity.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "mesh/solidity_parts.h"

#include <stdlib.h>

/* What a triangle and a vertex take while edges are found, and afterwards at most. */
static const double BYTES_PER_TRIANGLE = 120.0, BYTES_PER_VERTEX = 24.0;

static vsh_result allocate(vshi_solidity *s, const vsh_mesh *meshes, size_t mesh_count, vsh_error *error) {
    vsh_result result =
        vshi_allocate((void **)&s->first_side, mesh_count + 1, sizeof *s->first_side, "what is solid", error);
    if (result != VSH_OK) {
        return result;
    }
    for (size_t m = 0; m < mesh_count; ++m) {
        s->first_side[m + 1] = s->first_side[m] + meshes[m].triangle_count;
    }
    const struct {
        void **memory;
        size_t count, size;
    } wanted[] = {{(void **)&s->found, s->wholes.count, sizeof *s->found},
                  {(void **)&s->first, s->wholes.count + 1, sizeof *s->first},
                  {(void **)&s->sides, s->first_side[mesh_count], 1},
                  {(void **)&s->holed, s->first_side[mesh_count], 1}};
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0] && result == VSH_OK; ++i) {
        result = vshi_allocate(wanted[i].memory, wanted[i].count, wanted[i].size, "what is solid", error);
    }
    return result;
}

static void set_sides(vshi_solidity *s) {
    for (size_t i = 0; i < s->count; ++i) {
        vshi_component *c = &s->components[i];
        const uint8_t *turned = s->found[c->whole].turned;
        const size_t first = s->first_side[s->wholes.first[c->whole]];
        c->stands = c->stands && c->kind == VSHI_KIND_SOLID;
        for (size_t at = 0; at < c->triangles && c->kind != VSHI_KIND_SHEET; ++at) {
            const uint32_t triangle = c->list[at];
            s->sides[first + triangle] = turned[triangle] ? VSHI_SIDE_BEFORE : VSHI_SIDE_BEHIND;
            s->holed[first + triangle] = c->open_edges > 0;
            c->turned += turned[triangle];
        }
    }
}

static vsh_result find(vshi_solidity *s, vshi_job *job, vsh_error *error) {
    vsh_result result = VSH_OK;
    for (size_t m = 0; m < s->wholes.count && result == VSH_OK; ++m) {
        result = vshi_components_find(&s->wholes.meshes[m], m, &s->found[m], error);
        s->first[m + 1] = s->first[m] + s->found[m].count;
        s->cap_count += s->found[m].rim_count;
        if (result == VSH_OK && vshi_job_advance(job, 1)) {
            result = vshi_job_fail_cancelled(job, error);
        }
    }
    s->count = s->first[s->wholes.count];
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&s->components, s->count, sizeof *s->components, "components", error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&s->caps, s->cap_count, sizeof *s->caps, "holes", error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&s->hole_of, s->cap_count, sizeof *s->hole_of, "holes", error);
    }
    if (result == VSH_OK) {
        result = vshi_kinds_find(s, error);
    }
    if (result == VSH_OK) {
        result = vshi_standing_find(s, job, error);
    }
    if (result == VSH_OK) {
        result = vshi_rooms_find(s, error);
    }
    if (result == VSH_OK) {
        set_sides(s);
    }
    return result;
}

/* Keeps what the components list; the rest was for finding them. */
static void tidy(vshi_solidity *s) {
    for (size_t m = 0; m < s->wholes.count; ++m) {
        uint32_t *list = s->found[m].list;
        s->found[m].list = NULL;
        vshi_components_free(&s->found[m]);
        s->found[m].list = list;
    }
}

vsh_result vshi_solidity_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                vshi_solidity **made, vsh_error *error) {
    *made = NULL;
    double bytes = 0.0;
    for (size_t m = 0; m < mesh_count; ++m) {
        bytes += BYTES_PER_TRIANGLE * (double)meshes[m].triangle_count +
                 BYTES_PER_VERTEX * (double)meshes[m].vertex_count;
    }
    vsh_result result = vshi_check_limit(run, bytes, "what is solid", error);
    vshi_solidity *s = NULL;
    vshi_job *job = NULL;
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&s, 1, sizeof *s, "what is solid", error);
    }
    if (result != VSH_OK) {
        return result;
    }
    result = vshi_wholes_make(meshes, mesh_count, &s->wholes, error);
    if (result == VSH_OK) {
        result = allocate(s, meshes, mesh_count, error);
    }
    if (result == VSH_OK) {
        job = vshi_job_begin(run, "solids", s->wholes.count);
        result = job == NULL ? vshi_fail(error, VSH_ERROR_MEMORY, "what is solid: the system refused memory")
                             : find(s, job, error);
    }
    vshi_job_end(job);
    if (result == VSH_OK) {
        tidy(s);
        *made = s;
    } else {
        vshi_solidity_free(s);
    }
    return result;
}

void vshi_solidity_free(vshi_solidity *s) {
    if (s == NULL) {
        return;
    }
    free(s->cuts);
    free(s->hole_of);
    free(s->caps);
    free(s->components);
    for (size_t m = 0; s->found != NULL && m < s->wholes.count; ++m) {
        vshi_components_free(&s->found[m]);
    }
    free(s->holed);
    free(s->sides);
    free(s->first_side);
    free(s->first);
    free(s->found);
    vshi_wholes_free(&s->wholes);
    free(s);
}

const uint8_t *vshi_solidity_sides(const vshi_solidity *s, size_t mesh) {
    return s->sides + s->first_side[mesh];
}

const uint8_t *vshi_solidity_holed(const vshi_solidity *s, size_t mesh) {
    return s->holed + s->first_side[mesh];
}

const vshi_component *vshi_solidity_components(const vshi_solidity *s, size_t *count) {
    *count = s->count;
    return s->components;
}

const vshi_component *vshi_solidity_of_whole(const vshi_solidity *s, size_t whole, size_t *count) {
    *count = s->first[whole + 1] - s->first[whole];
    return s->components + s->first[whole];
}

const vshi_cut *vshi_solidity_cuts(const vshi_solidity *s, size_t *count) {
    *count = s->cut_count;
    return s->cuts;
}

const vshi_wholes *vshi_solidity_wholes(const vshi_solidity *s) {
    return &s->wholes;
}
