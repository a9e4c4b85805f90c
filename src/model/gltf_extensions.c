/* What a glTF says that nobody can read it without. */
#include "model/gltf.h"

#include <string.h>

/* Extensions that are read, or that leave the geometry as it is. */
static const char *const understood[] = {
    "KHR_mesh_quantization",   "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing", "EXT_meshopt_compression",
    "KHR_meshopt_compression", /* */
    "KHR_texture_transform",   "KHR_texture_basisu",
    "EXT_texture_webp",        "EXT_texture_avif",
    "MSFT_texture_dds",        "KHR_lights_punctual",
    "EXT_lights_image_based",  "EXT_lights_ies",
    "KHR_animation_pointer",   "KHR_xmp",
    "KHR_xmp_json_ld",         "MOZ_lightmap",
    "KHR_audio_emitter",
};

/* Materials change no geometry, whatever they are called. */
static const char material[] = "KHR_materials_";

static const struct {
    const char *name, *advice;
} advices[] = {
    {"KHR_node_visibility", "export it with only those nodes that are to be seen"},
    {"KHR_gaussian_splatting", "it holds no triangles"},
};

static bool understands(const char *name) {
    for (size_t i = 0; i < sizeof understood / sizeof understood[0]; ++i) {
        if (strcmp(name, understood[i]) == 0) {
            return true;
        }
    }
    return strncmp(name, material, sizeof material - 1) == 0;
}

vsh_result vshi_gltf_check_extensions(const vshi_gltf *gltf, vsh_error *error) {
    size_t i;
    const json_t *item;
    json_array_foreach(json_object_get(gltf->root, "extensionsRequired"), i, item) {
        const char *name = json_string_value(item);
        if (name == NULL) {
            return vshi_gltf_fail(gltf, error, "extensionsRequired[%zu] is no name", i);
        }
        if (understands(name)) {
            continue;
        }
        const char *advice = "export it without that extension";
        for (size_t k = 0; k < sizeof advices / sizeof advices[0]; ++k) {
            advice = strcmp(name, advices[k].name) == 0 ? advices[k].advice : advice;
        }
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: cannot be read without the glTF extension '%s', which is not known here: %s",
                         gltf->path, name, advice);
    }
    return VSH_OK;
}
