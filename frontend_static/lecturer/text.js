/** What is said of a class and its polls. */

/** @import { PollPublic } from "../shared/messages.js" */

/**
 * "1 follows", "23 follow".
 *
 * @param {number} followers
 */
export function following(followers) {
  return followers === 1 ? "1 follows" : `${followers} follow`;
}

/**
 * "1 sees another page", "23 see another page".
 *
 * @param {number} followers
 */
export function seeElsewhere(followers) {
  return followers === 1 ? "1 sees another page" : `${followers} see another page`;
}

/**
 * Where a poll stands, as a sentence; with the answers, once they are shown.
 *
 * @param {PollPublic} poll
 * @param {{own?: number|null, followers?: number, asks: boolean}} beside One's own answer, how many are asked, and whether one is asked oneself.
 */
export function pollWords(poll, { own = null, followers, asks }) {
  if (poll.counts !== null) return resultWords(poll.answers, poll.counts);
  if (!asks && poll.votes === null) return "Nobody follows: ask for a show of hands.";
  if (!asks) return `${voted(poll.votes ?? 0, followers)}. The answers are shown to all when you reveal them.`;
  if (own === null) return "Click or tap an answer, or press its number; nobody sees who answered what.";
  return `You answered “${poll.answers[own]}”. It can be changed until the answers are revealed.`;
}

/**
 * @param {number} votes
 * @param {number|undefined} followers
 */
function voted(votes, followers) {
  const have = votes === 1 ? "has" : "have";
  return followers === undefined ? `${votes} ${have} answered` : `${votes} of ${followers} ${have} answered`;
}

const IN_A_SENTENCE = new Intl.ListFormat("en-GB");

/**
 * "Most answered “No”, 14 of 23; “Yes” 9."
 *
 * @param {readonly string[]} answers
 * @param {readonly number[]} counts
 */
export function resultWords(answers, counts) {
  const votes = counts.reduce((sum, count) => sum + count, 0);
  if (votes === 0) return "Nobody has answered.";
  const ranked = answers.map((text, place) => ({ text, count: counts[place] })).sort((a, b) => b.count - a.count);
  const [first] = ranked;
  const ahead = ranked.filter(({ count }) => count === first.count).map(({ text }) => `“${text}”`);
  const rest = ranked.slice(ahead.length).map(({ text, count }) => `“${text}” ${count}`).join(", ");
  const figures = `${first.count} of ${votes}${rest && `; ${rest}`}.`;
  if (ahead.length > 1) return `${IN_A_SENTENCE.format(ahead)} were answered equally often, each ${figures}`;
  return 2 * first.count > votes ? `Most answered “${first.text}”, ${figures}` : `“${first.text}” was answered most often, ${figures}`;
}
