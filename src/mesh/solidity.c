#include "mesh/solidity.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "mesh/mesh_set.h"
#include "mesh/solidity_parts.h"

#include <stdlib.h>
#include <string.h>

/* The most memory for a triangle and for a vertex, while edges are found and afterwards. */
static const double BYTES_PER_TRIANGLE = 120.0, BYTES_PER_VERTEX = 24.0;
/* The same of terrains, whose edges are known. */
static const double TERRAIN_BYTES_PER_TRIANGLE = 9.0, TERRAIN_BYTES_PER_VERTEX = 4.0;

/* --- objects put together from their parts */

static bool one_object(const vsh_mesh *a, const vsh_mesh *b) {
    return a->object != 0 && a->object == b->object && a->solidity == b->solidity &&
           vshi_mesh_same_transform(a->transform, b->transform);
}

static vsh_result put_together(const vsh_mesh *parts, size_t count, vshi_wholes *w, vsh_error *error) {
    vsh_mesh *whole = &w->meshes[w->count];
    *whole = parts[0];
    for (size_t i = 1; i < count; ++i) {
        whole->vertex_count += parts[i].vertex_count;
        whole->triangle_count += parts[i].triangle_count;
    }
    if (count == 1) {
        return VSH_OK;
    }
    whole->normals = whole->uvs = NULL;
    VSHI_TRY(vshi_allocate((void **)&w->positions[w->count], whole->vertex_count, 3 * sizeof(float),
                           "parts of an object", error));
    VSHI_TRY(vshi_allocate((void **)&w->indices[w->count], whole->triangle_count, 3 * sizeof(uint32_t),
                           "parts of an object", error));
    float *position = w->positions[w->count];
    uint32_t *index = w->indices[w->count], before = 0;
    whole->positions = position;
    whole->indices = index;
    for (size_t i = 0; i < count; ++i) {
        if (parts[i].vertex_count > 0) {
            memcpy(position, parts[i].positions, parts[i].vertex_count * 3 * sizeof *position);
        }
        position += 3 * parts[i].vertex_count;
        for (size_t k = 0; k < 3 * parts[i].triangle_count; ++k) {
            *index++ = before + parts[i].indices[k];
        }
        before += (uint32_t)parts[i].vertex_count;
    }
    return VSH_OK;
}

static vsh_result wholes_make(const vsh_mesh *meshes, size_t mesh_count, vshi_wholes *w, vsh_error *error) {
    *w = (vshi_wholes){0};
    const vshi_array arrays[] = {VSHI_ARRAY(w->meshes, mesh_count), VSHI_ARRAY(w->first, mesh_count + 1),
                                 VSHI_ARRAY(w->of, mesh_count), VSHI_ARRAY(w->positions, mesh_count),
                                 VSHI_ARRAY(w->indices, mesh_count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "objects", error));
    for (size_t m = 0, next; m < mesh_count; m = next) {
        size_t vertices = meshes[m].vertex_count;
        for (next = m + 1; next < mesh_count && one_object(&meshes[m], &meshes[next]) &&
                           vertices + meshes[next].vertex_count <= UINT32_MAX;
             ++next) {
            vertices += meshes[next].vertex_count;
        }
        const vsh_result result = put_together(meshes + m, next - m, w, error);
        for (size_t part = m; part < next; ++part) {
            w->of[part] = w->count;
        }
        w->first[++w->count] = next; /* wholes_free() frees it after a failure too */
        VSHI_TRY(result);
    }
    return VSH_OK;
}

static void wholes_free(vshi_wholes *w) {
    for (size_t i = 0; i < w->count; ++i) {
        free(w->positions[i]);
        free(w->indices[i]);
    }
    free(w->indices);
    free(w->positions);
    free(w->of);
    free(w->first);
    free(w->meshes);
    *w = (vshi_wholes){0};
}

/* --- what is solid */

static vsh_result allocate(vshi_solidity *s, const vsh_mesh *meshes, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&s->first_side, s->mesh_count + 1, sizeof *s->first_side, "what is solid",
                           error));
    for (size_t m = 0; m < s->mesh_count; ++m) {
        s->first_side[m + 1] = s->first_side[m] + meshes[m].triangle_count;
    }
    const size_t triangles = s->first_side[s->mesh_count];
    const vshi_array arrays[] = {
        VSHI_ARRAY(s->found, s->wholes.count),     VSHI_ARRAY(s->lent, s->wholes.count),
        VSHI_ARRAY(s->first, s->wholes.count + 1), VSHI_ARRAY(s->turned, triangles),
        VSHI_ARRAY(s->sides, triangles),           VSHI_ARRAY(s->holed, triangles)};
    return VSHI_ALLOCATE_ALL(arrays, "what is solid", error);
}

static void set_sides(vshi_solidity *s) {
    for (size_t i = 0; i < s->count; ++i) {
        vshi_component *c = &s->components[i];
        const uint8_t *turned = vshi_solidity_turned(s, c);
        const size_t first = s->first_side[s->wholes.first[c->whole]];
        const bool encloses = c->kind != VSHI_KIND_SHEET;
        for (size_t at = 0; at < c->triangles && (encloses || c->vessel); ++at) {
            const uint32_t triangle = c->list[at];
            const uint8_t side = turned[triangle] ? VSHI_SIDE_BEFORE : VSHI_SIDE_BEHIND;
            s->sides[first + triangle] = encloses ? side : VSHI_SIDE_SHEET;
            s->holed[first + triangle] = c->open_edges > 0 ? side : VSHI_SIDE_SHEET;
            c->turned += encloses && turned[triangle];
        }
    }
}

/* The components of a whole of these meshes, where another solidity found them; else NULL. */
static const vshi_components *find_known(const vsh_mesh *meshes, const vshi_wholes *wholes, size_t whole) {
    const size_t first = wholes->first[whole], count = wholes->first[whole + 1] - first;
    const struct vsh_checked_mesh *known = vshi_mesh_known(&meshes[first]);
    const vshi_solidity *s = known != NULL ? known->solidity : NULL;
    for (size_t m = 0; m < count; ++m) {
        const struct vsh_checked_mesh *part = vshi_mesh_known(&meshes[first + m]);
        if (s == NULL || part == NULL || part->solidity != s || part->place != known->place + m) {
            return NULL;
        }
    }
    const size_t place = s->wholes.of[known->place];
    return s->wholes.first[place] == known->place && s->wholes.first[place + 1] == known->place + count
               ? &s->found[place]
               : NULL;
}

/* Wholes that are looked at, each for itself. */
typedef struct finding {
    vshi_solidity *s;
    const vsh_mesh *meshes;
} finding;

/* A vshi_element_fn over wholes. */
static vsh_result find_whole(void *user, size_t w, vsh_error *error) {
    const finding *f = user;
    vshi_solidity *s = f->s;
    const vshi_components *known = find_known(f->meshes, &s->wholes, w);
    if (known != NULL) {
        s->found[w] = *known;
        s->lent[w] = true;
    } else {
        VSHI_TRY(vshi_components_find(&s->wholes.meshes[w], w, &s->found[w], error));
    }
    const size_t triangles = s->wholes.meshes[w].triangle_count;
    if (triangles > 0) {
        memcpy(s->turned + s->first_side[s->wholes.first[w]], s->found[w].turned, triangles);
    }
    return VSH_OK;
}

static vsh_result find_components(vshi_solidity *s, const vsh_mesh *meshes, vshi_job *job, vsh_error *error) {
    finding f = {s, meshes};
    VSHI_TRY(vshi_parallel_each(job, s->wholes.count, 1, 1, find_whole, &f, error));
    for (size_t w = 0; w < s->wholes.count; ++w) {
        s->first[w + 1] = s->first[w] + s->found[w].count;
        s->cap_count += s->found[w].rim_count;
    }
    s->count = s->first[s->wholes.count];
    return VSH_OK;
}

static vsh_result find(vshi_solidity *s, const vsh_mesh *meshes, vshi_job *job, vsh_error *error) {
    VSHI_TRY(find_components(s, meshes, job, error));
    VSHI_TRY(vshi_allocate((void **)&s->components, s->count, sizeof *s->components, "components", error));
    VSHI_TRY(vshi_allocate((void **)&s->caps, s->cap_count, sizeof *s->caps, "holes", error));
    VSHI_TRY(vshi_kinds_find(s, job, error));
    VSHI_TRY(vshi_rooms_find(s, error));
    set_sides(s);
    return VSH_OK;
}

vsh_result vshi_solidity_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                vshi_solidity **made, vsh_error *error) {
    *made = NULL;
    double bytes = 0.0;
    for (size_t m = 0; m < mesh_count; ++m) {
        vshi_terrain terrain;
        const bool known = vshi_mesh_is_terrain(&meshes[m], &terrain);
        bytes +=
            (known ? TERRAIN_BYTES_PER_TRIANGLE : BYTES_PER_TRIANGLE) * (double)meshes[m].triangle_count +
            (known ? TERRAIN_BYTES_PER_VERTEX : BYTES_PER_VERTEX) * (double)meshes[m].vertex_count;
    }
    VSHI_TRY(vshi_check_limit(run, bytes, "what is solid", error));
    vshi_solidity *s = NULL;
    VSHI_TRY(vshi_allocate((void **)&s, 1, sizeof *s, "what is solid", error));
    s->mesh_count = mesh_count;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(wholes_make(meshes, mesh_count, &s->wholes, error));
    VSHI_TRY_DONE(allocate(s, meshes, error));
    job = vshi_job_begin(run, "solids", s->wholes.count);
    result = job == NULL ? vshi_fail(error, VSH_ERROR_MEMORY, "what is solid: the system refused memory")
                         : find(s, meshes, job, error);
done:
    vshi_job_end(job);
    if (result != VSH_OK) {
        vshi_solidity_free(s);
        s = NULL;
    }
    *made = s;
    return result;
}

void vshi_solidity_free(vshi_solidity *s) {
    if (s == NULL) {
        return;
    }
    free(s->cuts);
    free(s->caps);
    free(s->components);
    for (size_t m = 0; s->found != NULL && s->lent != NULL && m < s->wholes.count; ++m) {
        if (!s->lent[m]) {
            vshi_components_free(&s->found[m]);
        }
    }
    free(s->holed);
    free(s->sides);
    free(s->turned);
    free(s->first_side);
    free(s->first);
    free(s->lent);
    free(s->found);
    wholes_free(&s->wholes);
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
