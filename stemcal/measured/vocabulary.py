"""What columns are called in the languages of laboratories.

Words of alphabets count where they stand alone, those of Chinese, Japanese and Korean, and those of several words,
wherever they stand.
"""

import re
import unicodedata
from collections.abc import Sequence

FORCE = (
    *("force", "load", "kraft", "fuerza", "carga", "effort", "forza", "força", "kuvvet", "kuvveti"),
    *("yük", "yükü"),
    *("сила", "усилие", "нагрузка", "зусилля", "навантаження"),
    *("力", "载荷", "负荷", "负载", "載荷", "荷重", "試験力", "힘", "하중", "시험력"),
)
TRAVEL = (
    *("displacement", "travel", "extension", "stroke", "position", "crosshead", "deflection", "deformation"),
    *("distance", "compression", "weg", "verformung", "desplazamiento", "deslocamento", "déplacement", "course"),
    *("spostamento", "corsa", "uzama", "uzaması", "deplasman", "deplasmanı", "yer değiştirme"),
    *("yerdeğiştirme", "strok", "stroku", "konum"),
    *("перемещение", "ход", "деформация", "удлинение", "прогиб", "путь", "смещение", "переміщення", "хід"),
    *("位移", "行程", "变形", "變形", "変位", "ストローク", "변위", "스트로크", "변형", "이동거리"),
)
TIME = (
    *("time", "zeit", "tiempo", "temps", "tempo", "zaman", "süre", "время", "час"),
    *("时间", "時間", "시간"),
)
DIAMETER = (
    *("diameter", "durchmesser", "diametro", "diámetro", "diamètre", "çap", "диаметр", "діаметр"),
    *("直径", "径", "직경", "지름", "reading", "measurement", "d1", "d2", "d3", "d4"),
)
LABEL = (
    *("stem", "sample", "specimen", "plant", "no", "no.", "nr", "nr.", "id", "number", "numune", "образец", "номер"),
    *("编号", "序号", "试样", "茎", "시편", "번호"),
)
FILE = ("file", "filename", "datei", "dosya", "файл", "文件", "파일")
GRADE = ("grade", "class", "等级", "分级", "등급")

# What holds one of the words above and is something else: stress, strain, rates.
OTHERS = (
    *("stress", "strain", "spannung", "dehnung", "tensión", "contrainte", "gerilme", "напряжение"),
    *("rate", "speed", "velocity", "geschwindigkeit", "hız", "скорость"),
    *("应力", "应变", "応力", "応変", "速度", "速率", "응력", "변형률", "속도"),
)
GERMAN = ("kraft", "weg", "zeit")  # also at the end of a word: Standardkraft, Traversenweg


def plain(text: str) -> str:
    """Return a text without the differences that do not count: case, wide letters, the Turkish dots of i.

    >>> plain("KUVVET（Ｎ）"), plain("YER DEĞİŞTİRME"), plain("ｋＮ")
    ('kuvvet(n)', 'yer değiştirme', 'kn')
    """
    return unicodedata.normalize("NFKC", text).replace("İ", "i").replace("ı", "i").casefold()


def is_called(name: str, words: Sequence[str]) -> bool:
    """Tell whether a column's name holds one of the words.

    >>> is_called("Max. Force (N)", FORCE), is_called("最大力/N", FORCE), is_called("reinforced", FORCE)
    (True, True, False)
    >>> is_called("Standardkraft", FORCE), is_called("Prüfkraft in N", FORCE), is_called("Déplacement", TRAVEL)
    (True, True, True)
    """
    lowered = plain(name)
    parts = set(re.findall(r"[^\W\d_]+\d?\.?|\d+", lowered)) | set(re.findall(r"[^\W\d_]+", lowered))
    sought = [plain(word) for word in words]
    ends = tuple(word for word in sought if word in GERMAN)
    return any(word in lowered if _anywhere(word) else word in parts for word in sought) or any(
        part.endswith(ends) for part in parts if ends
    )


def _anywhere(word: str) -> bool:
    return min(word) >= "\u1100" or " " in word


_FOREIGN = tuple(plain(word) for word in (*FORCE, *TRAVEL, *TIME, *DIAMETER, *LABEL, *OTHERS) if not word.isascii())


def familiarity(text: str) -> int:
    """Return how many letters of a text belong to words known here that are not ASCII: how well it was decoded.

    >>> familiarity("Сила, Н") > familiarity("Сила, Н".encode("cp1251").decode("cp1252"))
    True
    """
    lowered = plain(text)
    return sum(len(word) ** 2 for word in _FOREIGN if word in lowered)
