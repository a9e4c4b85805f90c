/* Primitives under KHR_draco_mesh_compression, decoded whole: every attribute in the type of its accessor. */
#include "io/lit/work.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char extension_name[] = "KHR_draco_mesh_compression";

const vshi_lit_draco *vshi_lit_find_draco(const vshi_lit_work *work, size_t mesh, size_t primitive) {
    for (size_t i = 0; i < work->dracos.count; ++i) {
        const vshi_lit_draco *draco = &work->dracos.list[i];
        if (draco->mesh == mesh && draco->primitive == primitive) {
            return draco;
        }
    }
    return NULL;
}

const vshi_lit_draco_attribute *vshi_lit_find_draco_attribute(const vshi_lit_draco *draco,
                                                              const json_t *primitive, const char *name) {
    const json_t *names = json_object_get(vshi_gltf_extension(primitive, extension_name), "attributes");
    size_t id;
    if (!vshi_gltf_count(names, name, SIZE_MAX, &id) || id == SIZE_MAX) {
        return NULL;
    }
    for (size_t i = 0; i < draco->attribute_count; ++i) {
        if (draco->attributes[i].id == id) {
            return &draco->attributes[i];
        }
    }
    return NULL;
}

void vshi_lit_dracos_free(vshi_lit_dracos *dracos) {
    for (size_t i = 0; i < dracos->count; ++i) {
        vshi_lit_draco *draco = &dracos->list[i];
        for (size_t k = 0; k < draco->attribute_count && !dracos->borrowed; ++k) {
            free(draco->attributes[k].values);
        }
        free(draco->attributes);
        if (!dracos->borrowed) {
            free(draco->indices);
        }
    }
    free(dracos->list);
    vshi_answer_free(&dracos->answer);
    *dracos = (vshi_lit_dracos){.list = NULL};
}

/* --- decoding */

static vsh_result decode_attribute(vshi_lit_work *work, const vshi_draco *mesh, const json_t *primitive,
                                   const char *name, const char *where, vshi_lit_draco_attribute *attribute,
                                   vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    const json_t *names = json_object_get(vshi_gltf_extension(primitive, extension_name), "attributes");
    vshi_gltf_accessor accessor;
    size_t id, index;
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), name, "accessors", where, &index,
                             error));
    if (index == SIZE_MAX || !vshi_gltf_count(names, name, SIZE_MAX, &id) || id > UINT32_MAX) {
        return vshi_gltf_fail(gltf, error, "%s: its compressed %s is no attribute of it", where, name);
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    *attribute = (vshi_lit_draco_attribute){id, accessor.type, accessor.components, NULL};
    const size_t size = (size_t)accessor.components * sizeof(float); /* no component is larger */
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&attribute->values, mesh->vertex_count, size, error));
    return accessor.components <= 4 &&
                   vshi_importers()->draco_elements(mesh, (uint32_t)id, accessor.type, accessor.components,
                                                    attribute->values)
               ? VSH_OK
               : vshi_gltf_fail(gltf, error, "%s: its Draco data has no attribute %zu of %d components",
                                where, id, accessor.components);
}

static vsh_result decode_arrays(vshi_lit_work *work, const vshi_draco *mesh, const json_t *primitive,
                                const char *where, vshi_lit_draco *draco, vsh_error *error) {
    json_t *names = json_object_get(vshi_gltf_extension(primitive, extension_name), "attributes");
    draco->vertex_count = mesh->vertex_count;
    draco->triangle_count = mesh->triangle_count;
    VSHI_TRY(vshi_gltf_draco_indices(&work->gltf, mesh, where, &draco->indices, error));
    VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&draco->attributes, json_object_size(names),
                                sizeof *draco->attributes, error));
    const char *name;
    json_t *value;
    json_object_foreach(names, name, value) {
        vshi_lit_draco_attribute *attribute = &draco->attributes[draco->attribute_count++];
        VSHI_TRY(decode_attribute(work, mesh, primitive, name, where, attribute, error));
    }
    return VSH_OK;
}

static vsh_result decode_primitive(vshi_lit_work *work, vshi_lit_draco *draco, vsh_error *error) {
    const json_t *of = vshi_gltf_element(&work->gltf, "meshes", draco->mesh);
    const json_t *primitive = json_array_get(json_object_get(of, "primitives"), draco->primitive);
    char where[96];
    snprintf(where, sizeof where, "meshes[%zu].primitives[%zu]", draco->mesh, draco->primitive);
    vshi_draco *mesh = NULL;
    VSHI_TRY(vshi_gltf_decode_draco(&work->gltf, vshi_gltf_extension(primitive, extension_name), where, &mesh,
                                    error));
    const vsh_result result = decode_arrays(work, mesh, primitive, where, draco, error);
    vshi_importers()->draco_free(mesh);
    return result;
}

/* Lists the places of all primitives under Draco. */
static vsh_result list_places(vshi_lit_work *work, vsh_error *error) {
    vshi_lit_dracos *dracos = &work->dracos;
    size_t m, p, capacity = 0;
    const json_t *mesh, *primitive;
    json_array_foreach(json_object_get(work->gltf.root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            if (vshi_gltf_extension(primitive, extension_name) != NULL) {
                VSHI_TRY(vshi_make_room((void **)&dracos->list, dracos->count, &capacity,
                                        sizeof *dracos->list, work->gltf.path, error));
                dracos->list[dracos->count++] = (vshi_lit_draco){.mesh = m, .primitive = p};
            }
        }
    }
    return VSH_OK;
}

static vsh_result decode_all(vshi_lit_work *work, vsh_error *error) {
    for (size_t i = 0; i < work->dracos.count; ++i) {
        VSHI_TRY(vshi_job_check(work->gltf.job, error));
        VSHI_TRY(decode_primitive(work, &work->dracos.list[i], error));
    }
    return VSH_OK;
}

/* --- the reader */

vsh_result vshi_serve_draco(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error) {
    (void)request;
    vshi_lit_work work = {.gltf = {.path = path, .run = run, .job = vshi_job_begin(run, "load", 1)}};
    vsh_result result;
    VSHI_TRY_DONE(work.gltf.job != NULL ? vshi_lit_open(&work, error)
                                        : vshi_fail_memory(error, work.gltf.path));
    VSHI_TRY_DONE(list_places(&work, error));
    VSHI_TRY_DONE(decode_all(&work, error));
    vshi_encode_count(payload, work.dracos.count);
    for (size_t i = 0; i < work.dracos.count; ++i) {
        const vshi_lit_draco *draco = &work.dracos.list[i];
        vshi_encode_count(payload, draco->vertex_count);
        vshi_encode_count(payload, draco->triangle_count);
        vshi_encode_array(payload, draco->indices, draco->triangle_count, sizeof(uint32_t[3]));
        vshi_encode_count(payload, draco->attribute_count);
        for (size_t k = 0; k < draco->attribute_count; ++k) {
            const vshi_lit_draco_attribute *attribute = &draco->attributes[k];
            vshi_encode_array(payload, attribute, 1, sizeof *attribute);
            vshi_encode_array(payload, attribute->values, draco->vertex_count,
                              (size_t)attribute->components * vshi_gltf_component_size(attribute->type));
        }
    }
done:
    vshi_job_end(work.gltf.job);
    vshi_lit_work_free(&work);
    return result;
}

/* --- the caller */

static vsh_result read_primitive(vshi_decoder *decoder, const char *path, vshi_lit_draco *draco,
                                 vsh_error *error) {
    enum { MOST_ATTRIBUTES = 4096 };
    draco->vertex_count = vshi_decode_count(decoder, UINT32_MAX);
    draco->triangle_count = vshi_decode_count(decoder, SIZE_MAX / 64);
    const void *indices = vshi_decode_array(decoder, draco->triangle_count, sizeof(uint32_t[3]));
    const size_t count = vshi_decode_count(decoder, MOST_ATTRIBUTES);
    if (decoder->bad) {
        return vshi_answer_fail(path, "its decoded vertices", error);
    }
    memcpy(&draco->indices, &indices, sizeof indices);
    for (size_t i = 0; i < 3 * draco->triangle_count; ++i) {
        if (draco->indices[i] >= draco->vertex_count) {
            return vshi_answer_fail(path, "a decoded index", error);
        }
    }
    VSHI_TRY(vshi_allocate((void **)&draco->attributes, count, sizeof *draco->attributes, path, error));
    for (; draco->attribute_count < count; ++draco->attribute_count) {
        vshi_lit_draco_attribute *attribute = &draco->attributes[draco->attribute_count];
        const vshi_lit_draco_attribute *given = vshi_decode_array(decoder, 1, sizeof *given);
        if (given == NULL || given->components < 0 || given->components > 4) {
            return vshi_answer_fail(path, "a decoded attribute", error);
        }
        *attribute = *given;
        attribute->values = NULL;
        const size_t size = (size_t)given->components * vshi_gltf_component_size(given->type);
        const void *values = size > 0 ? vshi_decode_array(decoder, draco->vertex_count, size) : NULL;
        if (decoder->bad || (values == NULL && draco->vertex_count > 0)) {
            return vshi_answer_fail(path, "a decoded attribute", error);
        }
        memcpy(&attribute->values, &values, sizeof values);
    }
    return VSH_OK;
}

vsh_result vshi_lit_dracos_decode(vshi_decoder *decoder, const char *path, vshi_lit_dracos *dracos,
                                  vsh_error *error) {
    dracos->borrowed = true;
    if (vshi_decode_count(decoder, UINT32_MAX) != dracos->count) {
        return vshi_answer_fail(path, "the number of its compressed meshes", error);
    }
    for (size_t i = 0; i < dracos->count; ++i) {
        VSHI_TRY(read_primitive(decoder, path, &dracos->list[i], error));
    }
    return vshi_decoder_ends(decoder) ? VSH_OK : vshi_answer_fail(path, "its end", error);
}

vsh_result vshi_lit_read_dracos(vshi_lit_work *work, vsh_error *error) {
    const vshi_gltf *gltf = &work->gltf;
    vshi_exchange exchange;
    VSHI_TRY(list_places(work, error));
    if (work->dracos.count == 0 || gltf->run->reader == NULL) {
        return decode_all(work, error);
    }
    VSHI_TRY(vshi_exchange_begin(&exchange, VSHI_READ_DRACO, gltf->path, gltf->run, error));
    VSHI_TRY(vshi_exchange_send_job(&exchange, gltf->job, 0, &work->dracos.answer, error));
    return vshi_lit_dracos_decode(&work->dracos.answer.payload, gltf->path, &work->dracos, error);
}
