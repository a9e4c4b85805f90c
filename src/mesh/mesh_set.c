#include "mesh/mesh_set.h"

#include "base/memory.h"
#include "base/try.h"
#include "mesh/alpha_mask.h"

#include <stdlib.h>

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

vsh_result vshi_mesh_set_create(const vsh_mesh *meshes, size_t count, vshi_mesh_set *set, vsh_error *error) {
    *set = (vshi_mesh_set){0};
    VSHI_TRY(vshi_allocate((void **)&set->meshes, count, sizeof *set->meshes, "meshes", error));
    VSHI_TRY(vshi_allocate((void **)&set->checked, count, sizeof *set->checked, "meshes", error));
    set->count = count;
    for (size_t m = 0; m < count; ++m) {
        const struct vsh_checked_mesh *known = vshi_mesh_known(&meshes[m]);
        struct vsh_checked_mesh *own = &set->checked[m];
        if (known != NULL) {
            *own = *known;
        } else {
            VSHI_TRY(vshi_mesh_look_over(&meshes[m], m, &own->report, error));
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
    *set = (vshi_mesh_set){0};
}

/* What is solid among just these meshes, in this order; NULL where nobody looked at them together. */
static const vshi_solidity *known_together(const vshi_mesh_set *set) {
    const vshi_solidity *solidity = set->count > 0 ? set->checked[0].solidity : NULL;
    if (solidity == NULL || vshi_solidity_mesh_count(solidity) != set->count) {
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
