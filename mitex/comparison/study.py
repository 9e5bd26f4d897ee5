"""A page for a blind test of preference: pairs of pictures beside their exemplar or words, without names.

The page shuffles questions and sides for each who opens it, and saves the answers as a file. Which methods a
question is about stands in study.json, which stays with whoever asks.
"""

from __future__ import annotations

import base64
import hashlib
import json
import random
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from mitex.batch import Plan
from mitex.comparison.html import QUALITY, template, text_of
from mitex.comparison.results import LIT, Result
from mitex.errors import ConfigError
from mitex.page import jpeg
from mitex.paths import atomic_write, expanded
from mitex.records import write_json
from mitex.training import values

PAGE, KEY = "study.html", "study.json"
MOST = 40  # questions to one person, as MeshNCA asked


@dataclass(frozen=True)
class Question:
    """Which of two methods is nearer to an exemplar, on a mesh.

    Attributes:
        exemplar, mesh: paths or names.
        methods: labels, of the first picture and of the second.
    """

    exemplar: str
    mesh: str
    methods: tuple[str, str]


@dataclass(frozen=True)
class Study:
    """The questions of a study.

    Attributes:
        id: a hash of questions and pictures, which answers name.
        questions: in an order that says nothing.
    """

    id: str
    questions: tuple[Question, ...]

    @staticmethod
    def load(folder: str | Path) -> Study:
        """That of a comparison's folder.

        Raises:
            ConfigError: There is none.
        """
        try:
            record = json.loads((expanded(folder) / KEY).read_text(encoding="utf-8"))
            return Study(values.check(record["id"], str), tuple(map(_question, record["questions"])))
        except (OSError, ValueError, TypeError, KeyError, RecursionError) as e:
            problem = f"'{folder}' holds no study of `mitex compare`"
            raise ConfigError(problem, "name the folder of a comparison that was made with a study") from e


def _question(record: Mapping[str, Any]) -> Question:
    kinds = get_type_hints(Question)
    question = Question(**{key: values.check(record[key], kind) for key, kind in kinds.items()})
    if len(set(question.methods)) < 2:
        raise ValueError(record)
    return question


def check_study(plan: Plan) -> None:
    """Checks, before any work, that there will be something to ask about.

    Raises:
        ConfigError: There is one method alone that is put on meshes.
    """
    if sum(part.output != "none" for part in plan.methods) < 2:
        problem = "a study of one method that is put on meshes asks nothing"
        raise ConfigError(problem, "name more methods, or leave out `study`")


def write_study(folder: Path, results: Sequence[Result], exemplars: Mapping[str, np.ndarray | None]) -> Path:
    """Writes study.html and study.json: all pairs of methods, on each exemplar and mesh that both have done.

    Args:
        folder: of the comparison.
        results: with their pictures, of which the first seed's are shown.
        exemplars: path, name or words -> picture; words, which have none, are shown themselves.

    Returns:
        The page.

    Raises:
        ConfigError: There are no two methods to compare.
        OutputError: The folder cannot be written to.
    """
    files = {
        (*result.pair, result.method): result.pictures[LIT]
        for result in reversed(results)
        if LIT in result.pictures
    }
    pictures: dict[str, bytes] = {}
    choices: dict[Question, list[str]] = {}
    for exemplar, mesh in dict.fromkeys((r.exemplar, r.mesh) for r in results if r.mesh is not None):
        methods = sorted({method for one, other, method in files if (one, other) == (exemplar, mesh)})
        if (image := exemplars[exemplar]) is not None:
            pictures.setdefault(exemplar, jpeg(image, QUALITY))
        for pair in combinations(methods, 2):
            of_pair = [files[exemplar, mesh, method] for method in pair]
            pictures |= {str(file): file.read_bytes() for file in of_pair}
            choices[Question(exemplar, mesh, pair)] = list(map(str, of_pair))
    if not choices:
        raise ConfigError("there are no two methods to ask about", "name more methods, or see what failed")
    return _write(folder, choices, pictures)


def _write(folder: Path, choices: Mapping[Question, Sequence[str]], pictures: Mapping[str, bytes]) -> Path:
    """Writes page and key.

    Args:
        folder: of the comparison.
        choices: names of each question's two pictures.
        pictures: name -> JPEG; those of exemplars are named as these.
    """
    hashes = [hashlib.sha256(content).hexdigest() for content in pictures.values()]
    subject = json.dumps([hashes, list(map(asdict, choices))])
    id = hashlib.sha256(subject.encode("utf-8", "surrogateescape")).hexdigest()[:16]
    shuffle = random.Random(id)
    questions = shuffle.sample(list(choices), len(choices))
    names = shuffle.sample(list(pictures), len(pictures))  # so that their places tell nothing either
    number = {name: k for k, name in enumerate(names)}
    data = {
        "id": id,
        "most": MOST,
        "questions": [
            {
                "exemplar": number.get(question.exemplar, question.exemplar),
                "choices": [number[name] for name in choices[question]],
            }
            for question in questions
        ],
        "pictures": [base64.b64encode(pictures[name]).decode() for name in names],
    }
    text = json.dumps(data).replace("<", "\\u003c")  # words could end the script
    page = template(PAGE).substitute(style=text_of("style.css"), data=text)
    write_json(folder / KEY, {"id": id, "questions": list(map(asdict, questions))})
    with atomic_write(folder / PAGE) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return folder / PAGE
