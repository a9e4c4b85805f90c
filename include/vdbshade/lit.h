/* Assets with their light: a glTF or GLB given back as it was, with lightmap UVs and the baked
 * images in its materials; a GLB made of a mesh file of another format; an OBJ (docs/lit.md). */
#ifndef VDBSHADE_LIT_H
#define VDBSHADE_LIT_H

#include "mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Chart of a triangle without a place in the atlas. */
#define VSH_LIT_NO_CHART UINT32_MAX

/* One mesh of a model as it is lit: the triangles of vsh_model_mesh() in their order, with vertices of the
 * atlas, each a copy of one of the mesh's. A view: nothing is copied or owned. */
typedef struct vsh_lit_mesh {
    const float *uvs; /* [vertex_count][2], v up: 0 … 1 of the page that its chart lies on. NULL: no new set;
                         the materials refer to set `uv_set` of the file */
    const uint32_t *sources; /* [vertex_count]: the vertex of the mesh that each is a copy of */
    const uint32_t *indices; /* [triangle_count][3]: into these; sources of them are the mesh's own indices */
    const uint32_t
        *charts; /* [triangle_count]: < chart_count, or VSH_LIT_NO_CHART; NULL: all lie on `page` */
    size_t vertex_count;
    size_t triangle_count;
    uint32_t page;  /* without charts */
    int32_t uv_set; /* without uvs: 0 … VSH_MAX_UV_SETS - 1, which the mesh must have; -1: the mesh stays as
                       it is, unlit */
} vsh_lit_mesh;

/* What an image does in the materials of its page. */
enum {
    VSH_LIT_OCCLUSION = 0, /* occlusionTexture of core glTF: R, linear, replaces the file's own */
    VSH_LIT_LIGHTMAP = 1,  /* MOZ_lightmap: R, G and B, linear irradiance, times its intensity */
    VSH_LIT_PREVIEW = 2, /* base colour of KHR_materials_unlit: R, G and B, sRGB, times the material's factor,
                            in place of its own texture. Materials that are cut out or blended by their
                            texture stay as they are */
    VSH_LIT_PURPOSES = 3
};

/* An image of one page for one purpose, at most one each. Either `png`, or planes. */
typedef struct vsh_lit_image {
    int32_t purpose;       /* VSH_LIT_… */
    uint32_t page;         /* from 0 */
    const void *png;       /* [png_size] bytes of a PNG file, which are taken as they are */
    size_t png_size;       /* bytes */
    int32_t width, height; /* of planes: texels, 1 … 65536 */
    const float *const
        *channels;         /* of planes: [channel_count][height × width], row 0 on top (v = 1), linear */
    int32_t channel_count; /* 1 (grey) or 3 */
    int32_t bits;          /* of planes: 8 or 16; 0: 8 */
    double intensity;      /* LIGHTMAP: by which viewers multiply it; 0: 1. Planes over 1 are divided by their
                              largest value, by which this is multiplied. PREVIEW: by which its planes are
                              multiplied before they are cut at 1; 0: 1 */
} vsh_lit_image;

/* Where images go. */
enum {
    VSH_LIT_IMAGES_AUTO = 0,   /* into a GLB, beside a glTF */
    VSH_LIT_IMAGES_EMBED = 1,  /* into the buffer */
    VSH_LIT_IMAGES_BESIDE = 2, /* OUT.PURPOSE.png, or OUT.PURPOSE.PAGE.png where there are several pages, or
                                  where a page has a name */
};

/* How a lit file is written. */
typedef struct vsh_lit_options {
    size_t struct_size;
    const uint32_t *chart_pages; /* [chart_count]: the page that each chart lies on */
    size_t chart_count;
    const vsh_lit_image *images; /* [image_count], in any order. A page without any leaves its materials as
                                    they are */
    size_t image_count;
    int32_t image_place;           /* VSH_LIT_IMAGES_… */
    const char *const *page_names; /* [page_count]: of pages, UTF-8, as file names may be: images have them in
                                      their names, and beside the file in place of the page's number. NULL,
                                      and a name that is NULL: none */
    size_t page_count;
    const vsh_attribute *attributes; /* [attribute_count]: where it comes from (provenance.h): into the extras
                                        of the document's asset, in place of earlier ones that begin with
                                        "vdbshade_"; comments of an .obj. Extras that are no object stay */
    size_t attribute_count;
} vsh_lit_options;

static inline vsh_lit_options vsh_lit_options_default(void) {
    vsh_lit_options options = {sizeof(vsh_lit_options), NULL, 0, NULL, 0,
                               VSH_LIT_IMAGES_AUTO,     NULL, 0, NULL, 0};
    return options;
}

/* Writes `output`, a .glb, .gltf or .obj by its ending.
 *
 * Where `path` is a .glb or .gltf, that document with all that it holds, known or not: each primitive that
 * has uvs gets them as TEXCOORD_1, or in place of a set that an earlier call made, which its extras list
 * ("vdbshade_uv_sets"). Where textures that stay use that set, it gets them as its first free TEXCOORD_n,
 * with a warning. Vertices are doubled only where the atlas splits them, and then all attributes and morph
 * targets of the primitive, byte by byte; primitives on several pages become several; meshes that several
 * nodes use, and instances of EXT_mesh_gpu_instancing, become meshes and nodes of their own where their UVs
 * differ, and share all accessors that do not. Primitives under Draco that change are written as they are
 * without it. Textures that an earlier call made, which their extras tell ("vdbshade_texture"), go with their
 * images where nothing shows them any more, unless the file has extensions that are not known. Images and
 * buffers that the file names beside it stay named where output stands in its folder, else they come along in
 * the buffer. A .gltf has its buffer beside it as OUT.bin.
 *
 * Of other formats, and where path is NULL, a document is made of the model: a node for each object with its
 * transform, positions, normals, the sets of UVs with the new one as the second, white materials.
 *
 * An .obj holds the model's meshes in the world, by their names, with the UVs that they are lit by alone. Its
 * images are PREVIEW, and stand beside it; a material page_N for each page (OUT.mtl, where there are images)
 * shows its image. Without images it has the UVs, and materials where there are several pages.
 *
 * `model` is what vsh_model_read() made of `path`, whose file has not changed since; `meshes` one for each of
 * its meshes, in the order of vsh_model_mesh(); NULL: all have their lightmap in the set that
 * vsh_model_mesh() takes for -1, on page 0. Draco's data is decoded by run->reader, where there is one.
 * Stage: "lit". Files are written beside their places and renamed when all are whole; a failure leaves old
 * ones as they were. Errors:
 * - VSH_ERROR_ARGUMENT: model, output or an array NULL; options, run; another ending; a
 *   mesh that does not fit the model's, a chart, page, set or image out of range, two images of one page and
 *   purpose, UVs that are not finite; an output that would replace a file that the input is made of, or an
 * OUT.mtl that is not ours;
 * - VSH_ERROR_INPUT: a document that is not well formed, or not the model's;
 * - VSH_ERROR_READ: as vsh_model_read(); a buffer that is short or missing;
 * - VSH_ERROR_LIMIT: run->memory_limit; a GLB of 4 GiB or more; as vsh_lit_check_uvs();
 * - VSH_ERROR_WRITE, VSH_ERROR_UNSUPPORTED, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_lit_write(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                                 const vsh_lit_options *options, const char *output, const vsh_run *run,
                                 vsh_error *error);

/* Whether every mesh that has uvs has room for them in what vsh_lit_write() would make of `path`, a .glb or
 * .gltf, for those who light by images that take long to bake: arguments as there, but that of images only
 * purpose and page are read. Files none of whose meshes has VSH_MAX_UV_SETS sets are not opened. Errors:
 * VSH_ERROR_LIMIT (a primitive with so many, none of which the new one replaces), VSH_ERROR_ARGUMENT (model
 * or meshes NULL, options, a mesh, an image, run), VSH_ERROR_INPUT, VSH_ERROR_READ, VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_lit_check_uvs(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                                     const vsh_lit_options *options, const vsh_run *run, vsh_error *error);

/* Whether the ending of `path` is that of a file that vsh_lit_write() writes: 1 or 0, which NULL is too. */
VSH_API int32_t vsh_lit_is_output(const char *path);

#ifdef __cplusplus
}
#endif
#endif
