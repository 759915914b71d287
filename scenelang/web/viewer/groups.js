// Groups of a stream, as rows' tokens have them (`scenelang/compiler/groups.py`), and how far rows matter
// (`Later` of `scenelang/compiler/graph.py`, which has the proof).

export const SMOOTH = 1;
export const SUBTRACT = 2;
const INTERSECT = 3;
export const OPERATOR = 3; // of a token: mask of the operator,
export const BEGINS = 4; // bit of a row that begins a group,
export const ENDS = 3; // and shift of the number of groups that end behind it

/**
 * What a row's token says, row by row, and how far it matters.
 *
 * `operator` and `blend` join it to the group `around` it (null: the stream), of which it may be the `first`;
 * `draws`: whether it may be seen where nothing was before; `adds`: whether it takes nothing away; `always`:
 * whether what was before ends outside of it, or of its group; `seen`: by which blends, `total`, `widest` and
 * `count` of their widths; whether by any, or one makes its edge (`blends`); whether these see how deep inside it
 * points are (`inside`); whether it matters wherever it is, being cut out of what they see (`hidden`).
 */
export function joinsOf(rows) {
  const joins = [];
  let open = null;
  rows.forEach(({ token, blend }, at) => {
    const operator = token & OPERATOR, first = (token & BEGINS) > 0;
    if (first) open = joint(operator, blend, open, { from: at, depth: 1 + (open?.depth ?? 0) });
    const always = operator === INTERSECT;
    joins.push(joint(first ? 0 : operator, first ? 0 : blend, open, { first, always }));
    for (let ends = token >> ENDS; ends > 0; ends -= 1, open = open.around) open.to = at;
  });
  let later = { total: 0, widest: 0, count: 0, blends: false, inside: false, hidden: false };
  for (let at = rows.length - 1; at >= 0; at -= 1) {
    const row = joins[at], ended = [];
    for (let group = row.around; group?.to === at; group = group.around) ended.unshift(group);
    for (const group of ended) {
      group.later = later;
      later = operandSeen(later, group);
    }
    row.seen = operandSeen(later, row);
    later = beforeSeen(later, row);
    if (row.first) later = beforeSeen(row.around.later, row.around);
  }
  return joins;
}

function joint(operator, blend, around, more) {
  return {
    operator, blend, around,
    kind: operator + (operator > SMOOTH && blend > 0 ? 2 : 0), // the cell's: behind operators rounded cuts
    draws: operator <= SMOOTH && (around?.draws ?? true),
    adds: (operator !== SUBTRACT) === (around?.adds ?? true),
    ...more,
  };
}

/** What sees the operand of an operator. */
function operandSeen(later, { operator, blend }) {
  const hidden = later.hidden || (operator === SUBTRACT && later.inside);
  if (!(blend > 0) && hidden === later.hidden) return later;
  if (blend > 0 && operator !== INTERSECT) return wider({ ...later, hidden }, blend, operator === SMOOTH);
  return { ...later, hidden, blends: later.blends || blend > 0, inside: later.inside || blend > 0 };
}

/** What sees all that an operator joins its operand to. */
function beforeSeen(later, { operator, blend }) {
  if (!(blend > 0)) return later;
  return operator === SMOOTH ? wider(later, blend, true) : { ...later, blends: true, inside: true };
}

function wider(later, blend, inside) {
  const { total, widest, count } = later;
  return {
    ...later,
    total: total + blend,
    widest: Math.max(widest, blend),
    count: count + 1,
    blends: true,
    inside: later.inside || inside,
  };
}

/** Of rows' joins the groups, in the order in which they begin, and how many are open at once at most. */
export function groupsOf(joins) {
  const groups = joins.filter(({ first }) => first).map(({ around }) => around);
  return { groups, depth: groups.reduce((most, { depth }) => Math.max(most, depth), 0) };
}
