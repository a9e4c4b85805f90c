#include "scene/solidity.h"

#include "base/memory.h"
#include "base/try.h"
#include "scene/select.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* To what it means by objects' names in all of the lists, or by those of materials; whether there is any. */
static bool apply_rule(const vsh_solidity_rule *rule, bool material, const vshi_mesh_list *lists,
                       size_t count) {
    bool matched = false;
    for (size_t k = 0; k < count; ++k) {
        for (size_t i = 0; lists[k].model != NULL && i < lists[k].count; ++i) {
            vsh_mesh *mesh = &lists[k].meshes[i];
            if (vshi_mesh_is_meant(mesh, rule->pattern, material)) {
                mesh->solidity = mesh->mask != NULL ? VSH_SOLIDITY_SHELL : rule->solidity;
                matched = true;
            }
        }
    }
    return matched;
}

/* Applies the rules of one caster, or of all. Each must match something. */
static vsh_result apply_rules(const vsh_solidity_rule *rules, size_t rule_count,
                              const vshi_mesh_list *casters, size_t count, vsh_error *error) {
    for (size_t r = 0; r < rule_count; ++r) {
        const vsh_solidity_rule *rule = &rules[r];
        const vshi_mesh_list *first = NULL;
        if (rule->pattern == NULL || rule->solidity < VSH_SOLIDITY_AUTO ||
            rule->solidity > VSH_SOLIDITY_INWARD) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "rule of solidity %zu: %s", r,
                             rule->pattern == NULL ? "pattern is NULL"
                                                   : "solidity is none of VSH_SOLIDITY_…");
        }
        for (size_t i = 0; i < count; ++i) {
            first = first == NULL && casters[i].model != NULL ? &casters[i] : first;
        }
        if (apply_rule(rule, false, casters, count) || apply_rule(rule, true, casters, count)) {
            continue;
        }
        if (first != NULL) {
            return vshi_fail_unmatched(first->model, first->path, rule->pattern, error);
        }
        return vshi_fail(error, VSH_ERROR_INPUT, "no object is named '%.100s': no caster is a mesh",
                         rule->pattern);
    }
    return VSH_OK;
}

static bool same_place(const vsh_mesh *a, const vsh_mesh *b) {
    return a->positions == b->positions && a->indices == b->indices &&
           vshi_mesh_same_transform(a->transform, b->transform);
}

static void share(const vshi_mesh_set *casters, const vshi_mesh_list *receiver) {
    for (size_t i = 0; i < receiver->count; ++i) {
        vsh_mesh *mesh = &receiver->meshes[i];
        for (size_t k = 0; k < casters->count && mesh->checked == NULL; ++k) {
            /* a file's meshes stand in the same order where all of them cast */
            const vsh_mesh *caster = &casters->meshes[(i + k) % casters->count];
            if (same_place(mesh, caster)) {
                mesh->checked = caster->checked;
                mesh->solidity = caster->solidity;
            }
        }
    }
}

/* All casters' meshes, one after the other. */
static vsh_result list_all(const vshi_mesh_list *casters, size_t caster_count, vsh_mesh **all, size_t *count,
                           vsh_error *error) {
    *count = 0;
    for (size_t i = 0; i < caster_count; ++i) {
        *count += casters[i].count;
    }
    VSHI_TRY(vshi_allocate((void **)all, *count, sizeof **all, "meshes", error));
    for (size_t i = 0, at = 0; i < caster_count; at += casters[i++].count) {
        if (casters[i].count > 0) {
            memcpy(*all + at, casters[i].meshes, casters[i].count * sizeof **all);
        }
    }
    return VSH_OK;
}

vsh_result vshi_solidity_settle(const vsh_scene *scene, const vshi_mesh_list *casters,
                                const vshi_mesh_list *receivers, const vsh_run *run, vshi_mesh_set *set,
                                vsh_error *error) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        VSHI_TRY(apply_rules(caster->solidity, caster->solidity_count, &casters[i], 1, error));
    }
    VSHI_TRY(apply_rules(scene->solidity, scene->solidity_count, casters, scene->caster_count, error));
    vsh_mesh *all = NULL;
    size_t count;
    vsh_result result;
    VSHI_TRY_DONE(list_all(casters, scene->caster_count, &all, &count, error));
    if (count == 0) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_mesh_set_create(all, count, set, error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(set, run, error));
    for (size_t i = 0, at = 0; i < scene->caster_count; ++i) {
        for (size_t k = 0; k < casters[i].count; ++k, ++at) {
            casters[i].meshes[k].checked = set->meshes[at].checked;
        }
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        share(set, &receivers[i]);
    }
done:
    free(all);
    return result;
}
