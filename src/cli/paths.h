/* File names: their parts, and whether two name one file. */
#ifndef CLI_PATHS_H
#define CLI_PATHS_H

#include <stdbool.h>
#include <stddef.h>

/* Text that lives as long as the process. */
const char *cli_keep_text(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The last part of a path: what stands behind its last slash. */
const char *cli_file_name(const char *path);

/* Whether `path` ends in ".ENDING", in any case, for one of the endings that blanks part. */
bool cli_has_ending(const char *path, const char *endings);

/* The NAME of FILE.vdb:NAME, of which *path keeps FILE.vdb; NULL for any other path, and if a file has the
 * whole name. */
const char *cli_split_grid(const char **path);

/* Endings of the meshes and the images that are read. */
#define CLI_MODEL_ENDINGS "obj gltf glb fbx dae ply stl"
#define CLI_IMAGE_ENDINGS                                                                                    \
    "exr png tif tiff jpg jpeg hdr tga bmp webp dpx psd pgm ppm pnm pfm gif jp2 j2k sgi rgb rla ico heic "   \
    "heif avif"

/* Whether the two name one file, whether by links or through folders; also where it does not exist yet. */
bool cli_same_file(const char *a, const char *b);

/* Refuses an output that is an input, `what`; NULL for either: there is none. CLI_OK or CLI_USAGE. */
int cli_check_apart(const char *output, const char *input, const char *what);

/* Whether a path ends as a mesh's file does (but for .ply, which may hold points alone). */
bool cli_is_model(const char *path);

/* Whether a path is a folder, or ends as one. */
bool cli_is_folder(const char *path);

/* A path with `end` in place of the slashes at its end, kept. */
const char *cli_end_path(const char *path, const char *end);

/* Outputs that a file names, and not the user, must not leave for elsewhere by links: the file and its folder
 * may be a stranger's. `path` is as it was made of the folder of `namer` and of what stands there; its links
 * must end where its words say, or below the folder of `namer`. CLI_OK or, having said why, CLI_FILE. */
int cli_check_links(const char *namer, const char *path);

/* Checks that an input can be opened. If not, prints why and returns CLI_FILE. */
int cli_check_input(const char *path);

/* Says which folder is missing where an output's is. CLI_OK or CLI_FILE. */
int cli_check_folder(const char *path);

/* Makes the folder that a file is in, and those that this is in, where they are not there. CLI_OK or
 * CLI_FILE, having said why. */
int cli_make_folder_of(const char *path);

/* --- outputs that are a file for each object (--per-object) */

/* What stands in an output's path for the name of its object. */
#define CLI_OBJECT_NAME "%s"

/* OUT as a path with CLI_OBJECT_NAME in it: "out/", a folder that is there and "out" (without an ending)
 * become out/%s.exr, out.png becomes out.%s.png. Kept. */
const char *cli_object_output(const char *output);

#endif
