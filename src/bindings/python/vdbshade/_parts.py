"""Parts of a bake that several machines share: files PARTS.I-of-N.part."""
from __future__ import annotations

import os
from typing import List, Optional, Sequence

from ._library import RUN, Run, call, ffi, lib, text
from ._structs import Filled, path_of


def words_into(filled: Filled, words: Sequence[str]) -> None:
    """Words that a part keeps."""
    if isinstance(words, str):
        raise TypeError("words: expected a list of str, got str")
    array = ffi.new("char *[]", [filled.text(w, "words") for w in words] or 1)
    filled.keeps.append(array)
    filled.pointer.words, filled.pointer.word_count = array, len(words)


def part_words(parts: "str | os.PathLike[str]", shard_count: int = 0, *, run: Optional[Run] = None) -> List[str]:
    """The words that were kept in the first part that is there, of `shard_count` shards (0: as many as there are). A part is
    whatever somebody has put there: words are text that its writer chose."""
    words, count = ffi.new("char ***"), ffi.new("size_t *")
    call(lib.vsh_part_words, path_of(parts, "parts"), shard_count, RUN, words, count, run=run)
    owned = ffi.gc(words[0], lib.vsh_part_words_free)
    return [text(owned[i]) or "" for i in range(count[0])]


__all__ = ["part_words"]
