"""The words of the report of `evaluate`, in English and French.

The report's code has English texts; `Words` translates them. `{name}` is a value. Singular and
plural are separate texts.
"""

from typing import Literal, get_args

from studio.engine.base.errors import SettingsError

Language = Literal["en", "fr"]

SIDES = {"left": "gauche", "right": "droite"}
_MASCULINE = {"droite": "droit"}

JOINTS = {
    "hips": "bassin", "spine": "colonne", "chest": "torse", "neck": "cou", "head": "tête",
    "shoulder": "épaule", "elbow": "coude", "wrist": "poignet", "hand": "main",
    "hip": "hanche", "knee": "genou", "ankle": "cheville", "toe": "orteil",
    "trunk": "tronc", "forearm": "avant-bras", "thigh": "cuisse", "shank": "jambe", "foot": "pied",
}  # fmt: skip
"""Joints and parts of the body in French, without their side."""
_HE = ("coude", "poignet", "genou", "orteil", "avant-bras", "pied")

KINDS = {
    "joint_pop": ("joint pops", "saut d'articulation"),
    "limb_flip": ("limb flips", "membre retourné"),
    "stance_slide": ("standing foot slides", "pied posé qui glisse"),
    "floor_penetration": ("through the floor", "à travers le sol"),
    "self_penetration": ("through the body", "à travers le corps"),
    "frozen_limb": ("limb stands still", "membre figé"),
}
"""Kinds of clean-up events, English and French, as on the studio's page."""

FRENCH = {
    "Figures of {take}": "Mesures de {take}",
    "{n} solve; what each figure is stands in docs/metrics.md.":
        "{n} résolution ; chaque mesure est expliquée dans docs/metrics.md.",
    "{n} solves; changes are against {base}. What each figure is stands in docs/metrics.md.":
        "{n} résolutions ; les écarts sont par rapport à {base}. Chaque mesure est expliquée dans docs/metrics.md.",
    "Figures": "Mesures",
    "time since the performance began": "temps depuis le début de la prestation",
    "Times are since the performance began, as in the replay: 0 is the first frame of {base}, stage time {begins} s. "
    "What is measured against the reference is so over the time and the joints that the reference has.":
        "Les temps comptent depuis le début de la prestation, comme à la lecture : 0 est la première image de "
        "{base}, au temps {begins} s du plateau. Ce qui est mesuré par rapport à la référence l'est au temps et aux "
        "articulations de la référence.",
    "Aligned away for {name}: {what}.": "Retiré par l'alignement pour {name} : {what}.",
    "{name}: {camera} was moved by {mm} mm and turned by {degrees} degrees before its depth was tracked.":
        "{name} : {camera} a été déplacée de {mm} mm et tournée de {degrees} degrés avant le suivi de sa profondeur.",
    "{name}: {camera} does not agree with the other cameras from {since} to {until} s of the solve "
    "({mm} mm off): doubt that part.":
        "{name} : {camera} ne concorde pas avec les autres caméras de {since} à {until} s de la résolution "
        "(écart de {mm} mm) : doutez de cette partie.",
    "turned by {angle} deg, moved by ({place}) m": "tourné de {angle} degrés, déplacé de ({place}) m",
    "scaled by {scale}": "mis à l'échelle {scale}",
    "clock {offset} ms and {drift} ppm ahead": "horloge en avance de {offset} ms et {drift} ppm",
    "offsets of {n} markers from the joints fitted on this take":
        "décalages de {n} marqueurs aux articulations ajustés sur cette prise",
    "Performers": "Interprètes",
    "performer": "interprète",
    "became another": "devenu un autre",
    "frames missed, %": "images manquées, %",
    "undecided, %": "indécises, %",
    "joint error of {name}, mm": "erreur des articulations de {name}, mm",
    "One transform aligns all performers. A performer became another where they are nearer to the other's reference.":
        "Une même transformation aligne tous les interprètes. Un interprète est devenu un autre là où il est plus "
        "près de la référence de l'autre.",
    "{name}, {solve}: not told apart from another from {since} to {until} s.":
        "{name}, {solve} : non distingué d'un autre de {since} à {until} s.",
    "Where they were": "Où ils étaient",
    "{solve}, from above: solve, and reference dashed":
        "{solve}, vu d'en haut : résolution, et référence en pointillés",
    "Error over time": "Erreur au cours du temps",
    "mean over joints": "moyenne des articulations",
    "Curves": "Courbes",
    "Relative to the chest, after alignment.": "Par rapport au torse, après alignement.",
    "The reference has no wrists and chest.": "La référence n'a ni poignets ni torse.",
    "Left out for clarity: {names}.": "Omis pour la clarté : {names}.",
    "{joint}, {axis}": "{joint}, {axis}",
    "reference": "référence",
    "Worst moments": "Pires moments",
    "{name}, over the reference (without colour), front and side":
        "{name}, sur la référence (sans couleur), de face et de côté",
    "All solves at the worst moments of {base}": "Toutes les résolutions aux pires moments de {base}",
    "mannequins of all solves at {n} moments": "mannequins de toutes les résolutions à {n} moments",
    "Error of each joint": "Erreur de chaque articulation",
    "mm, from the front": "mm, de face",
    "What would have to be cleaned up": "Ce qu'il faudrait retoucher",
    "{name}: not measured": "{name} : non mesuré",
    "{name}: nothing": "{name} : rien",
    "{name}: {n} event": "{name} : {n} retouche",
    "{name}: {n} events": "{name} : {n} retouches",
    "what": "quoi", "joint": "articulation", "from, s": "de, s", "to, s": "à, s", "size": "taille",
    "detail": "détail",
    "left and right swapped": "gauche et droite échangées",
    "{part} in {other}": "{part} dans {other}",
    "What each switch gained or cost": "Ce que chaque réglage apporte ou coûte",
    "Change of {figure} against {base}": "{figure} : écart par rapport à {base}",
    "joint error": "erreur des articulations",
    "absolute difference": "différence absolue",
    "shortest distance": "plus courte distance",
    "Intervals are 95 %, by bootstrap over blocks of {seconds} s of this take; other takes may differ by more.":
        "Intervalles à 95 %, par rééchantillonnage de blocs de {seconds} s de cette prise ; d'autres prises peuvent "
        "différer davantage.",
    "solve": "résolution",
    "what differs from {base}": "ce qui diffère de {base}",
    "{switch}: {before} to {after}": "{switch} : {before} devient {after}",
    "effectors": "effecteurs",
    "the same switches": "les mêmes réglages",
    "Not every solve has settings, so what differs between them is not known.":
        "Toutes les résolutions n'ont pas de réglages : ce qui les distingue n'est pas connu.",
    "joint error, mm": "erreur des articulations, mm",
    "joint error from the hips, mm": "erreur des articulations depuis le bassin, mm",
    "joints within 50 mm": "articulations à moins de 50 mm",
    "joint angles, degrees": "angles des articulations, degrés",
    "acceleration error, m/s2": "erreur d'accélération, m/s2",
    "delay, ms": "retard, ms",
    "absolute difference, cm": "différence absolue, cm",
    "shortest distance, cm": "plus courte distance, cm",
    "spike difference, the thesis's": "différence de pics, de la thèse",
    "deviations": "déviations",
    "jerk, m/s3": "à-coups, m/s3",
    "foot slide in the reference's stance, cm/s": "glissement des pieds, appuis de la référence, cm/s",
    "foot slide in its own stance, cm/s": "glissement des pieds, ses propres appuis, cm/s",
    "height of standing feet, cm off": "hauteur des pieds posés, écart en cm",
    "spread of bones, mm": "variation des os, mm",
    "truth within the 90 % ball": "vérité dans la boule à 90 %",
    "clean-up events a minute, against the reference": "retouches par minute, par rapport à la référence",
}  # fmt: skip


class Words:
    """The report's words in one language.

    Args:
        language: `en` or `fr`.

    Raises:
        SettingsError: another language.
    """

    def __init__(self, language: Language = "en") -> None:
        if language not in get_args(Language):
            raise SettingsError(
                "report.language",
                "a report in {language!r} is not there; allowed: {allowed}",
                language=language,
                allowed=[*get_args(Language)],
            )
        self.language = language

    def __call__(self, english: str, **values: object) -> str:
        """Return a text with its values."""
        words = FRENCH[english].replace(" :", "\u00a0:").replace(" ;", "\u00a0;") if self._french else english
        return words.format(**values)

    def joint(self, name: str) -> str:
        """Return a canonical joint, or a part of the body, in words."""
        side, _, part = name.partition("_")
        if not self._french or not part:
            return JOINTS.get(name, name) if self._french else name.replace("_", " ")
        french = JOINTS.get(part, part)
        which = SIDES.get(side, side)
        return f"{french} {_MASCULINE.get(which, which) if french in _HE else which}"

    def kind(self, kind: str) -> str:
        """Return a kind of clean-up event in words."""
        return KINDS[kind][self._french]

    def detail(self, detail: str) -> str:
        """Return the detail of a clean-up event, as `metrics.cleanup` gives it."""
        part, inside, other = detail.partition(" in ")
        if inside:
            names = [self.joint(name.replace(" ", "_")) for name in (part, other)]
            return self("{part} in {other}", part=names[0], other=names[1])
        return self(detail) if detail else ""

    @property
    def _french(self) -> bool:
        return self.language == "fr"


ENGLISH = Words("en")
