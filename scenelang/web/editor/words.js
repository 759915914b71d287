// The words and terminals of the language, written by lab/docs/make_words.py.
export const WORDS = [
  {"scope": "keyword.declaration", "words": ["nsg", "model", "param", "let", "fn", "module", "import", "as"], "after": ""},
  {"scope": "keyword.control", "words": ["for", "in", "step", "if", "else"], "after": ""},
  {"scope": "storage.type.node", "words": ["group", "chain", "union", "smooth", "subtract", "intersect"], "after": ""},
  {"scope": "storage.type.material", "words": ["material"], "after": ""},
  {"scope": "constant.language.boolean", "words": ["true", "false"], "after": ""},
  {"scope": "constant.language", "words": ["PI", "TAU", "X", "Y", "Z", "none"], "after": ""},
  {"scope": "variable.language", "words": ["t", "u", "frame", "frames"], "after": "(?!\\s*[({])"},
  {"scope": "support.function.setting", "words": ["canvas", "background", "animate", "samples", "camera", "light", "ground", "sky"], "after": "(?=\\s*\\()"},
  {"scope": "support.function.transform", "words": ["translate", "rotate", "scale", "shear", "matrix", "twirl", "bend", "twist", "displace", "grow", "shell", "flip", "color", "grayscale", "hue", "opacity", "glow", "density", "roughness", "stop"], "after": "(?=\\s*\\()"},
  {"scope": "support.function", "words": ["sin", "cos", "tan", "asin", "acos", "atan2", "abs", "min", "max", "clamp", "floor", "ceil", "round", "sqrt", "exp", "log", "mix", "smoothstep", "len", "str", "rand", "noise", "rgb", "hsv"], "after": "(?=\\s*\\()"},
];
export const TERMINALS = {
  "NAME": "[A-Za-z_][A-Za-z0-9_]*(?!\\w)",
  "NUMBER": "(?:[0-9]+(?:\\.(?!\\.)[0-9]*)?|\\.[0-9]+)(?:[eE][+-]?[0-9]+)?(?:deg|rad|turn|ms|s)?(?![\\w°]|\\.[0-9])",
  "COLOR": "#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})(?!\\w)",
  "STRING": "\"(?:[^\"\\\\\n]|\\\\[^\n])*\""
};
export const SIGNS = ["..<", "..", "||", "&&", "==", "!=", "<=", ">=", "=", ".", "?", ":", "<", ">", "+", "-", "*", "/", "%", "!", "^"];
