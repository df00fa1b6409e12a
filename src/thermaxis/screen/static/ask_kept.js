// @ts-check
// The last requests of a person, kept in this window of the browser from page to page until
// somebody else looks, or nobody: another log-in begins with an empty list.

/** @typedef {import("./ask.js").Course} Course */

const KEPT = "thermaxis.requests";
const ANSWERS = ["waits", "accepted", "refused", "unknown"];

function person() {
  return document.body.dataset.name ?? "";
}

/** @param {Course[]} courses */
export function keep(courses) {
  if (!person()) return;
  try {
    sessionStorage.setItem(KEPT, JSON.stringify({ name: person(), courses }));
  } catch {
    // a browser that keeps nothing shows what this page has asked
  }
}

/** What this person has asked from another page. @returns {Course[]} */
export function kept() {
  try {
    const found = JSON.parse(sessionStorage.getItem(KEPT) ?? "{}");
    if (person() && found.name === person() && Array.isArray(found.courses)) {
      return found.courses.filter(isCourse).map(unanswered);
    }
    sessionStorage.removeItem(KEPT);
  } catch {
    // nothing is kept, or nothing of ours
  }
  return [];
}

/** @param {any} one */
function isCourse(one) {
  return one !== null && typeof one === "object" && typeof one.title === "string"
    && typeof one.method === "string" && Array.isArray(one.args) && Array.isArray(one.english)
    && Number.isFinite(one.requested) && ANSWERS.includes(one.answer);
}

/** The page that waited for an answer is gone: it may still take effect. @param {Course} course
 * @returns {Course} */
function unanswered(course) {
  return course.answer === "waits"
    ? { ...course, answer: "unknown", answered: course.requested } : course;
}
