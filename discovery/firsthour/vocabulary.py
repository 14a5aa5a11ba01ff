"""The words of shop floors, in several languages: what each says of a column, as log odds.

A column has a quantity (what is measured) and a place (where). A word raises the odds of some quantities and
places; nothing else decides (see `evidence`). To teach a word, add it to a row.

A word means itself; `~word` may also be a part of a longer one, as in German compounds. Words of other
scripts are always looked for inside. Names are folded before: small letters, ae oe ue ss, no accents.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

QUANTITIES = (
    "temperature",
    "displacement",
    "correction",
    "nozzle height",
    "nozzle side",
    "flow",
    "speed",
    "power",
    "signal",
    "current",
    "voltage",
    "torque",
    "position",
    "other",
    "state",
    "fan",
)
PLACES = ("body", "air", "fluid", "coolant")
SET_POINT = "set point"

# gloss (what replaces a word of another script in the name of a channel), log odds, words
_ROWS: tuple[tuple[str, Mapping[str, float], str], ...] = (
    # quantities
    (
        "temp",
        {"temperature": 7},
        "~temp ~temperature ~temperatur temperaturen ~temperatura temperatures temps ~温度 ~气温 ~気温 ~온도 "
        "~температура ~темп",
    ),
    ("temp", {"temperature": 5}, "t ti tc te tt thermo ~thermocouple ~thermoelement rtd"),
    ("temp", {"temperature": 5}, "pt100 pt1000 ntc ~熱電対"),
    ("temp", {"temperature": 6}, "~水温 ~油温 ~液温 ~體溫 ~表面温"),
    ("temp", {"temperature": 3}, "indoor indoors sensor ~fuehler ~センサ"),
    (
        "disp",
        {"displacement": 6},
        "disp displ ~displacement ~verlagerung ~verschiebung ~auslenkung ~変位 ~位移 ~변위 "
        "~deplacement ~spostamento ~desplazamiento ~deslocamento ~verplaatsing ~przemieszczenie ~posunuti "
        "~forskjutning ~смещение ~erweiterung",
    ),
    (
        "error",
        {"displacement": 5},
        "error errors err ~fehler ~abweichung dev deviation ~誤差 ~误差 ~偏差 ~오차 ~ecart "
        "~erreur ~errore erro ~scostamento ~desviacion ~afwijking fout blad ~odchylka ~avvikelse "
        "~погрешность tcp ~positionierfehler",
    ),
    (
        "growth",
        {"displacement": 5},
        "growth elongation expansion ~ausdehnung ~dehnung ~伸び ~伸长 ~热变形 ~熱変位 "
        "~drift lvdt ~messtaster ~taster ~wegaufnehmer ~wegsensor gap rtest runout ~allongement "
        "~dilatation ~dilatacion ~deformacion ~deformazione ~nullpunkt etve",
    ),
    ("probe", {"displacement": 3}, "probe shift eddy ~プローブ"),
    (
        "correction",
        {"correction": 9, "displacement": -1},
        "corr ~correction comp ~compensation ~korrektur ~kompensation ~補正 ~补偿 applied ~correzione",
    ),
    ("offset", {"correction": 7}, "offset offsets"),
    ("height", {"nozzle height": 6}, "h_nozzle nozzle_height ~duesenhoehe nozzle_h ~ノズル高さ"),
    ("side", {"nozzle side": 6}, "nozzle_side side_nozzle ~duesenseite"),
    (
        "flow",
        {"flow": 6},
        "flow ~flow_rate ~durchfluss ~volumenstrom ~volume_stream ~流量 ~유량 debit ~portata ~caudal ~расход",
    ),
    ("flow", {"flow": 3}, "ft"),  # ISA tags: FT110 sends a flow, TT140 a temperature
    ("pump", {"flow": 6}, "pump ~pumpe pumps ~ポンプ ~泵 ~펌프 pompe ~pompa bomba ~насос ~pomp cerpadlo"),
    (
        "speed",
        {"speed": 7},
        "speed rpm n rev revs revolution revolutions ~drehzahl ~回転数 ~回転速度 ~转速 ~회전수 vitesse "
        "~velocita ~velocidad velocidade rotacao ~toerental ~predkosc ~obroty ~otacky varvtal ~обороты "
        "nist nsoll",
    ),
    (
        "spindle",
        {"speed": 2, "power": 0.5, "body": 1},
        "spindle ~spindel ~主軸 ~主轴 ~스핀들 broche mandrino husillo fuso spil ~wrzecion ~vreteno ~шпиндель",
    ),
    (
        "power",
        {"power": 6},
        "power p pw watt watts ~leistung ~wirkleistung ~電力 ~消費電力 ~功率 ~전력 puissance potenza "
        "potencia ~vermogen moc vykon effekt ~мощность q ph qh qheat",
    ),
    (
        "heat",
        {"power": 5},
        "heater heaters heat heating ~heizung ~heizer ~heizpatrone ~heizleistung ~ヒータ ~ヒーター ~加熱 "
        "~加热 ~히터 chauffage riscaldatore calefactor loss losses ~verlust ~нагрев",
    ),
    (
        "load",
        {"power": 3, "current": 2, "torque": 2},
        "load drive motor ~antrieb ~負荷 ~负载 ~負載 ~モータ ~电机 last spindellast motorlast ~auslastung",
    ),
    (
        "duty",
        {"signal": 6},
        "duty dutycycle duty_cycle pwm ssr ~stellgroesse ~stellgrad ~stellwert ~stellung control "
        "controller valve ~ventil ~操作量 ~バルブ u mv",
    ),
    ("output", {"signal": 1.5, "temperature": -2, "power": 1}, "output ~ausgang ~出力"),
    (
        "current",
        {"current": 6, "power": 0.5},
        "current ~strom amp amps ampere amperes ~電流 ~电流 ~전류 courant corrente corriente ~ток",
    ),
    ("voltage", {"voltage": 7}, "voltage volt volts v ~spannung ~電圧 ~电压 ~전압 tension tensione tension"),
    (
        "torque",
        {"torque": 7},
        "torque ~drehmoment ~moment ~トルク ~扭矩 force ~kraft couple coppia ~schnittkraft",
    ),
    (
        "position",
        {"position": 5},
        "position pos axis ~achse ~位置 feed feedrate ~vorschub ~送り ~进给 avance posizione "
        "x_pos y_pos z_pos",
    ),
    (
        "humidity",
        {"other": 7},
        "rh humidity ~feuchte ~feuchtigkeit ~湿度 ~습도 humidite umidita humedad ~dewpoint ~taupunkt ~露点",
    ),
    (
        "pressure",
        {"other": 7},
        "pressure ~druck ~圧力 ~压力 ~압력 pression pressione presion ~vibration ~schwingung ~振動 "
        "~振动 acceleration accel co2 wind ~leitfaehigkeit ~conductivity",
    ),
    (
        "irradiance",
        {"other": 7},
        "~irradiance ~irradiation ~radiation ~einstrahlung ~globalstrahlung irrad insolation "
        "i_sol ghi dni dhi poa gti ~日射",
    ),
    ("sun", {"other": 4}, "~solar sol sun sonne"),
    ("angle", {"other": 6}, "~azimut zenith elevation altitude declination aoi angle ~winkel"),
    (
        "efficiency",
        {"other": 6},
        "efficiency eff ~wirkungsgrad ~効率 level ~fuellstand ~液位 ~level cost price counter",
    ),
    (
        "state",
        {"state": 6},
        "state status mode fault alarm ~zustand ~betriebsart door ~tuer ~ドア ~门 ~stoerung ~状態 ~状态 "
        "error_code code program programm flag ~freigabe enable occupants number",
    ),
    (
        "fan",
        {"fan": 8, "flow": -3},
        "fan fans ~luefter ~ventilator ~ファン ~风扇 ~팬 ventilateur ventola ventilador blower ~geblaese",
    ),
    (
        SET_POINT,
        {},
        "setpoint setpoints set_point set_points set target targets ~soll ~sollwert ~sollwerte "
        "sp ~設定 ~设定 "
        "~目標 ~目标 ~설정 consigne consigna",
    ),
    # places
    (
        "ambient",
        {"air": 9, "temperature": 1.5},
        "amb ambient env environment ~umgebung ~umgebungs outside outdoor outdoors "
        "ext external surrounding surroundings ~aussen ~外気 ~周囲 ~环境 ~環境 ~室外 ambiant ambiante "
        "ambiental ambiente ~주변 "
        "exterieur esterno exterior ~omgeving ~otoczeni okoli omgivning ta taussen",
    ),
    (
        "air",
        {"air": 7.5, "temperature": 1.5},
        "air airtemp airtemperature hall ~halle ~hallen ~luft shop workshop nave taller ~verkstad "
        "~車間 ~车间 ~工場",
    ),
    (
        "room",
        {"air": 7, "temperature": 1.5},
        "room ~raum ~raeume rum rumstemp rumstemperatur ~室温 ~室内 ~실내 "
        "salle atelier officina stanza sala cabinet lab ~labor chamber ~kammer ~チャンバ ~恒温室",
    ),
    (
        "fluid",
        {"fluid": 8, "flow": 0.5},
        "fluid emulsion kss ~kuehlschmierstoff sump ~cutting_fluid tank ~切削液 ~切削油 "
        "~절삭유 ~クーラントタンク fluide lubrifiant lubrorefrigerante",
    ),
    (
        "inlet",
        {"fluid": 6},
        "inlet inflow intake ~zulauf ~eintritt ~einlass entree ingresso entrada ~入口",
    ),
    (
        "cell",
        {},
        "cell cells battery batteries batt pack ~batterie akku ~akkus zelle accu bateria ~電池 ~电池 soc ocv",
    ),
    (
        "coolant",
        {"coolant": 8},
        "coolant ~kuehlmittel ~kuehlwasser ~kuehlung ~kuhlmittel chiller ~冷却水 ~クーラント "
        "~冷却液 ~冷却 ~냉각 refroidissement refrigerante ~koelvloeistof ~koelmiddel ~chlodziw "
        "~chladivo kylvatska cooler cooling cool ~kuehl ~kuehler",
    ),
    ("cool", {"coolant": 2, "power": 0}, "~水 ~油 water ~wasser oil ~oel"),
    (
        "body",
        {"body": 2, "temperature": 1},
        "housing bearing plate body bed table column headstock tailstock ~lager "
        "~gehaeuse ~bett ~tisch ~staender ~ベッド ~軸受 ~轴承 ~床身 "
        "~コラム ~テーブル nut ~mutter ~ballscrew ~screw "
        "~schlitten "
        "saddle ram frame ~rahmen ~gestell palier tavola mesa bancada ~立柱 extruder nozzle nut guide "
        "~fuehrung ~motor "
        "~モータ ~电机 wall wand",
    ),
)

# names that are formulas rather than words
_FORMS: tuple[tuple[str, Mapping[str, float], str], ...] = (
    ("error", {"displacement": 6}, r"\be ?[xyzabcr](\d[a-z]*|[abcsxyz]{0,2})\b"),  # of ISO 230, not "east"
    ("inlet", {"fluid": 6}, r"\b(hot|cold|water|steam|shell|tube|feed|primary|secondary) in(let)?\b"),
    ("disp", {"displacement": 4}, r"\b(d|delta) ?[xyz](?![^\W\d_])"),
    ("disp", {"displacement": 2, "position": 2}, r"\b[xyz](?![^\W\d_])"),
    ("current", {"current": 5}, r"^i(?= [^\W\d_])"),  # the symbol with a word behind it: alone it counts rows
    ("voltage", {"voltage": 5}, r"^u(?= [^\W\d_])"),
    ("nozzle height", {"nozzle height": 7}, r"\bnozzle.*height\b|\bh nozzle\b"),
    ("nozzle side", {"nozzle side": 7}, r"\bnozzle.*side\b|\bside.*nozzle\b"),
)


_SYMBOL = re.compile(r"(?<![^\W_])T([a-z]{3,})")


@dataclass(frozen=True)
class Word:
    """One word that a name holds: `said` as the name spells it, `gloss` in English, and what it says."""

    said: str
    gloss: str
    says: Mapping[str, float]


def fold(text: str) -> str:
    """Small letters without accents, words apart by one blank: "Kühlwasser_Temp.1" is "kuehlwasser temp 1".

    >>> fold("DutyCycle_1"), fold("温度（℃）"), fold("Größe"), fold("Troom"), fold("Tank")
    ('duty cycle 1', '温度 °c', 'groesse', 't room', 'tank')
    """
    text = unicodedata.normalize("NFKC", text.replace("℃", "°C").replace("℉", "°F"))
    text = _SYMBOL.sub(lambda found: f"T {found[1]}" if found[1] in _words() else found[0], text)
    text = re.sub(r"(?<=[a-zäöüß])(?=[A-Z])", " ", text).lower()
    for letter, pair in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ł", "l")):
        text = text.replace(letter, pair)
    text = "".join(
        unicodedata.normalize("NFD", c)[0] if unicodedata.name(c, "").startswith("LATIN") else c for c in text
    )
    return re.sub(r"[^\w°%µμ]+|_+", " ", text).strip()


def words_of(name: str) -> list[Word]:
    """What the words of a name say; of words that overlap the longest counts."""
    folded = fold(name)
    found = []
    free = [True] * len(folded)
    for start, end, row in sorted(_matches(folded), key=lambda one: (one[0] - one[1], one[0])):
        gloss, says, _ = (*_ROWS, *_FORMS)[row]
        if all(free[start:end]):
            found.append((start, Word(folded[start:end], gloss, says)))
            free[start:end] = [False] * (end - start)
    return [word for _, word in sorted(found, key=lambda one: one[0])]


@lru_cache(maxsize=1)
def _words() -> frozenset[str]:
    """Words that may stand behind the symbol of a temperature: Troom, Tbearing."""
    return frozenset(word.lstrip("~") for _, _, words in _ROWS for word in words.split())


@lru_cache(maxsize=1024)
def _matches(folded: str) -> tuple[tuple[int, int, int], ...]:
    return tuple((*found.span(), row) for row, form in _patterns() for found in form.finditer(folded))


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[int, re.Pattern[str]], ...]:
    found = []
    for row, (_, _, words) in enumerate(_ROWS):
        for word in words.split():
            inside = word.startswith("~")
            text = re.escape(fold(word.lstrip("~"))).replace(r"\ ", " ?")
            edges = ("", "") if inside else (r"(?<![^\W_])", r"(?![^\W\d_])")
            found.append((row, re.compile(f"{edges[0]}{text}{edges[1]}")))
    found += [(len(_ROWS) + k, re.compile(form)) for k, (_, _, form) in enumerate(_FORMS)]
    return tuple(found)
